//! Equal keys among millions: positions of triangles that lie side by side, triangles that a file has twice.
//!
//! Keys are distributed by their hashes to tables that are filled at the same time, each of which stays in a cache of
//! the processor. Seeds of the hashes are random (no file can be made for long chains), and no result depends on them,
//! or on the number of threads.

use foldhash::fast::RandomState;
use rayon::prelude::*;
use std::hash::{BuildHasher, Hash};

/// Keys of a piece: places in it have sixteen bits.
const PIECE: usize = 1 << 16;
/// Number of tables, a power of two. Pieces of fewer keys than some tables have would be cut into crumbs.
const TABLES: usize = 64;

/// For each of `count` keys the index of the first that equals it.
pub(super) fn first_equal<K>(count: usize, key: impl Fn(usize) -> K + Sync) -> Vec<u32>
where
    K: Copy + Default + Eq + Hash + Send + Sync,
{
    let state = RandomState::default();
    let hash = |key: &K| (state.hash_one(key) >> 32) as u32;
    if count <= PIECE {
        let mut table = Table::new(count);
        let mut first = |i: usize| {
            let key = key(i);
            table.first(i as u32, key, hash(&key), hash)
        };
        return (0..count).map(&mut first).collect();
    }
    let pieces: Vec<Piece<K>> = (0..count.div_ceil(PIECE))
        .into_par_iter()
        .map(|piece| Piece::new((piece * PIECE..count.min((piece + 1) * PIECE)).map(&key), hash))
        .collect();
    // By table, the firsts of its keys in their order.
    let firsts: Vec<Vec<u32>> = (0..TABLES)
        .into_par_iter()
        .map(|t| {
            let keys = pieces.iter().map(|piece| piece.of_table(t).len()).sum::<usize>();
            let (mut table, mut firsts) = (Table::new(keys / 4), Vec::with_capacity(keys));
            for (p, piece) in pieces.iter().enumerate() {
                for Placed { key, hash: of_key, place } in piece.of_table(t) {
                    firsts.push(table.first((p * PIECE) as u32 + u32::from(*place), *key, *of_key, hash));
                }
            }
            firsts
        })
        .collect();
    let mut next = [0_usize; TABLES];
    let mut all = Vec::with_capacity(count);
    for table in pieces.iter().flat_map(|piece| &piece.tables) {
        let table = usize::from(*table);
        all.push(firsts[table][next[table]]);
        next[table] += 1;
    }
    all
}

fn table_of(hash: u32) -> usize {
    hash as usize % TABLES
}

/// A key with its place in a piece.
#[derive(Clone, Copy, Default)]
struct Placed<K> {
    key: K,
    hash: u32,
    place: u16,
}

/// A run of keys, sorted by tables: a table's keys lie side by side, and are read from there as they come.
struct Piece<K> {
    placed: Vec<Placed<K>>,
    /// The tables of the keys in their order.
    tables: Vec<u8>,
    /// Where each table's keys begin, and the end.
    begin: [u32; TABLES + 1],
}

impl<K: Copy + Default> Piece<K> {
    fn new(keys: impl Iterator<Item = K>, hash: impl Fn(&K) -> u32) -> Self {
        let hashed: Vec<(K, u32)> = keys.map(|key| (key, hash(&key))).collect();
        let tables: Vec<u8> = hashed.iter().map(|(_, hash)| table_of(*hash) as u8).collect();
        let mut begin = [0_u32; TABLES + 1];
        for table in &tables {
            begin[usize::from(*table) + 1] += 1;
        }
        for t in 0..TABLES {
            begin[t + 1] += begin[t];
        }
        let (mut next, mut placed) = (begin, vec![Placed::default(); hashed.len()]);
        for (place, (key, hash)) in hashed.into_iter().enumerate() {
            let at = &mut next[usize::from(tables[place])];
            placed[*at as usize] = Placed { key, hash, place: place as u16 };
            *at += 1;
        }
        Self { placed, tables, begin }
    }

    fn of_table(&self, table: usize) -> &[Placed<K>] {
        &self.placed[self.begin[table] as usize..self.begin[table + 1] as usize]
    }
}

/// Open addressing: a slot has a key and its index.
struct Table<K> {
    slots: Vec<Slot<K>>,
    used: usize,
}

#[derive(Clone, Copy)]
struct Slot<K> {
    key: K,
    index: u32,
}

/// An index that no key has: there are fewer than 2^32.
const FREE: u32 = u32::MAX;

impl<K: Copy + Default + Eq> Table<K> {
    /// With room for so many different keys; it grows.
    fn new(keys: usize) -> Self {
        Self { slots: vec![Self::free(); (2 * keys).next_power_of_two().max(16)], used: 0 }
    }

    fn free() -> Slot<K> {
        Slot { key: K::default(), index: FREE }
    }

    /// The index of the first key that equals this one, whose index that becomes where there is none.
    fn first(&mut self, index: u32, key: K, of_key: u32, hash: impl Fn(&K) -> u32) -> u32 {
        let mask = self.slots.len() - 1;
        let mut at = start(of_key, mask);
        loop {
            let slot = self.slots[at];
            if slot.index == FREE {
                break;
            }
            if slot.key == key {
                return slot.index;
            }
            at = (at + 1) & mask;
        }
        self.slots[at] = Slot { key, index };
        self.used += 1;
        if 2 * self.used > self.slots.len() {
            self.grow(hash);
        }
        index
    }

    fn grow(&mut self, hash: impl Fn(&K) -> u32) {
        let slots = std::mem::take(&mut self.slots);
        self.slots = vec![Self::free(); 2 * slots.len()];
        let mask = self.slots.len() - 1;
        for slot in slots.into_iter().filter(|slot| slot.index != FREE) {
            let mut at = start(hash(&slot.key), mask);
            while self.slots[at].index != FREE {
                at = (at + 1) & mask;
            }
            self.slots[at] = slot;
        }
    }
}

/// The slot where the search for a hash begins. Its last bits have chosen the table.
fn start(hash: u32, mask: usize) -> usize {
    (hash as usize / TABLES) & mask
}

/// The key by which exactly equal positions are found. Adding 0 turns -0 into 0, so that both are one position.
pub(super) fn position_key(position: [f64; 3]) -> [u64; 3] {
    position.map(|c| (c + 0.0).to_bits())
}

/// Makes exactly equal positions one: the different ones in the order of their first occurrence, and for every position
/// its place among them. (Nearly equal ones stay: which of them are one is not ours to guess.) Positions are equal
/// whose keys are.
pub(super) fn merge_equal<K>(
    count: usize,
    key: impl Fn(usize) -> K + Sync,
    position: impl Fn(usize) -> [f64; 3],
) -> (Vec<[f64; 3]>, Vec<u32>)
where
    K: Copy + Default + Eq + Hash + Send + Sync,
{
    let mut places = first_equal(count, key);
    let mut different = Vec::new();
    for i in 0..count {
        let first = places[i] as usize;
        places[i] = if first == i {
            different.push(position(i));
            different.len() as u32 - 1
        } else {
            places[first]
        };
    }
    (different, places)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use std::collections::HashMap;

    #[test]
    fn the_first_of_equal_ones_is_found_in_few_and_in_many() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        for (count, different) in [(0, 1), (1, 1), (1000, 10), (1000, 100_000), (300_000, 3), (300_000, 50_000)] {
            let keys: Vec<u32> = (0..count).map(|_| random.random_range(0..different)).collect();
            let mut known = HashMap::new();
            let expected: Vec<u32> =
                keys.iter().enumerate().map(|(i, key)| *known.entry(*key).or_insert(i as u32)).collect();
            assert_eq!(first_equal(keys.len(), |i| keys[i]), expected, "{count} of {different}");
        }
    }

    #[test]
    fn zeros_of_both_signs_are_one_position_and_each_position_keeps_its_first_form() {
        let positions = [[0.0, 1.0, 2.0], [3.0, 1.0, 2.0], [-0.0, 1.0, 2.0], [-0.0, 5.0, 0.0], [0.0, 5.0, -0.0]];
        let (different, places) = merge_equal(positions.len(), |i| position_key(positions[i]), |i| positions[i]);
        assert_eq!(places, [0, 1, 0, 2, 2]);
        assert_eq!(different[2][0].to_bits(), (-0.0_f64).to_bits());
    }
}
