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
pub(super) fn first_equal<K: Copy + Eq + Hash>(count: usize, key: impl Fn(usize) -> K + Sync) -> Vec<u32> {
    let state = RandomState::default();
    let hash = |i: usize| (state.hash_one(key(i)) >> 32) as u32;
    if count <= PIECE {
        let mut table = Table::new(count);
        return (0..count).map(|i| table.first(i as u32, hash(i), &key)).collect();
    }
    let pieces: Vec<Piece> = (0..count.div_ceil(PIECE))
        .into_par_iter()
        .map(|piece| Piece::new((piece * PIECE..count.min((piece + 1) * PIECE)).map(hash)))
        .collect();
    // By table, the firsts of its keys in their order.
    let firsts: Vec<Vec<u32>> = (0..TABLES)
        .into_par_iter()
        .map(|t| {
            let keys = pieces.iter().map(|piece| piece.of_table(t).len()).sum::<usize>();
            let (mut table, mut firsts) = (Table::new(keys / 4), Vec::with_capacity(keys));
            for (p, piece) in pieces.iter().enumerate() {
                for place in piece.of_table(t) {
                    let place = usize::from(*place);
                    firsts.push(table.first((p * PIECE + place) as u32, piece.hashes[place], &key));
                }
            }
            firsts
        })
        .collect();
    let mut next = [0_usize; TABLES];
    let mut all = Vec::with_capacity(count);
    for hash in pieces.iter().flat_map(|piece| &piece.hashes) {
        let table = table_of(*hash);
        all.push(firsts[table][next[table]]);
        next[table] += 1;
    }
    all
}

fn table_of(hash: u32) -> usize {
    hash as usize % TABLES
}

/// A run of keys, sorted by tables.
struct Piece {
    hashes: Vec<u32>,
    /// Places in the run, table by table.
    places: Vec<u16>,
    /// Where each table's places begin, and the end.
    begin: [u32; TABLES + 1],
}

impl Piece {
    fn new(hashes: impl Iterator<Item = u32>) -> Self {
        let hashes: Vec<u32> = hashes.collect();
        let mut begin = [0_u32; TABLES + 1];
        for hash in &hashes {
            begin[table_of(*hash) + 1] += 1;
        }
        for t in 0..TABLES {
            begin[t + 1] += begin[t];
        }
        let (mut next, mut places) = (begin, vec![0; hashes.len()]);
        for (place, hash) in hashes.iter().enumerate() {
            let at = &mut next[table_of(*hash)];
            places[*at as usize] = place as u16;
            *at += 1;
        }
        Self { hashes, places, begin }
    }

    fn of_table(&self, table: usize) -> &[u16] {
        &self.places[self.begin[table] as usize..self.begin[table + 1] as usize]
    }
}

/// Open addressing: a slot has the index of a key and its hash, so that other keys are hardly ever looked at.
struct Table {
    slots: Vec<Slot>,
    used: usize,
}

#[derive(Clone, Copy)]
struct Slot {
    hash: u32,
    index: u32,
}

/// An index that no key has: there are fewer than 2^32.
const FREE: Slot = Slot { hash: 0, index: u32::MAX };

impl Table {
    /// With room for so many different keys; it grows.
    fn new(keys: usize) -> Self {
        Self { slots: vec![FREE; (2 * keys).next_power_of_two().max(16)], used: 0 }
    }

    /// The index of the first key that equals the key of `index`, which becomes that where there is none.
    fn first<K: Eq>(&mut self, index: u32, hash: u32, key: impl Fn(usize) -> K) -> u32 {
        let mask = self.slots.len() - 1;
        let mut at = start(hash, mask);
        loop {
            let slot = self.slots[at];
            if slot.index == FREE.index {
                break;
            }
            if slot.hash == hash && key(slot.index as usize) == key(index as usize) {
                return slot.index;
            }
            at = (at + 1) & mask;
        }
        self.slots[at] = Slot { hash, index };
        self.used += 1;
        if 2 * self.used > self.slots.len() {
            self.grow();
        }
        index
    }

    fn grow(&mut self) {
        let slots = std::mem::take(&mut self.slots);
        self.slots = vec![FREE; 2 * slots.len()];
        let mask = self.slots.len() - 1;
        for slot in slots.into_iter().filter(|slot| slot.index != FREE.index) {
            let mut at = start(slot.hash, mask);
            while self.slots[at].index != FREE.index {
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
/// its place among them. (Nearly equal ones stay: which of them are one is not ours to guess.)
pub(super) fn merge_equal(count: usize, position: impl Fn(usize) -> [f64; 3] + Sync) -> (Vec<[f64; 3]>, Vec<u32>) {
    let mut places = first_equal(count, |i| position_key(position(i)));
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
        let (different, places) = merge_equal(positions.len(), |i| positions[i]);
        assert_eq!(places, [0, 1, 0, 2, 2]);
        assert_eq!(different[2][0].to_bits(), (-0.0_f64).to_bits());
    }
}
