//! Hash tables for the stages after the check, which look up every operation that they make.
//!
//! Hashing takes a fraction of what the standard library's does. It is seeded at random: a script cannot choose
//! constants that collide.

use foldhash::fast::RandomState;

/// A table.
pub(crate) type HashMap<K, V> = std::collections::HashMap<K, V, RandomState>;

/// A set.
pub(crate) type HashSet<K> = std::collections::HashSet<K, RandomState>;
