//! Damage to files of any format: to bytes, words of binary numbers, numbers in text, lines, nesting.

use crate::damage::Random;
use std::ops::Range;

/// Chooses one of several things.
pub(crate) fn choose<'t, T: ?Sized>(random: &mut Random, of: &'t [&'t T]) -> &'t T {
    of[random.below(of.len())]
}

/// Numbers that readers and what follows them may not expect.
const NUMBERS: [&str; 32] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "0.5",
    "1e-320",
    "1e-30",
    "1e-12",
    "1e-3",
    "1e3",
    "1e6",
    "1e11",
    "1e12",
    "1e18",
    "1e30",
    "1e38",
    "3.5e38",
    "1e154",
    "1e308",
    "-1e308",
    "1e999",
    "nan",
    "inf",
    "-inf",
    "null",
    "true",
    "2147483647",
    "2147483648",
    "4294967295",
    "18446744073709551615",
    "99999999999999999999999999999999999999",
];

/// Bit patterns of numbers in binary files.
const WORDS: [u64; 14] = [
    0,
    1,
    0xff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7f80_0000,
    0x7fc0_0000,
    0x7f7f_ffff,
    0x5d5e_0b6b,
    0x7ff0_0000_0000_0000,
    0x7fef_ffff_ffff_ffff,
    0x43ab_c168_64cb_1920,
    u64::MAX,
];

/// Beginnings and ends of nested things.
const NESTS: [(&str, &str); 4] = [("[", "]"), ("{\"a\":", "}"), ("(", ")"), ("\"", "\"")];

/// A damaged copy.
pub(crate) fn damaged(content: &[u8], random: &mut Random) -> Vec<u8> {
    let mut content = content.to_vec();
    let times = 1 + random.below(2) * random.below(4);
    for _ in 0..times {
        once(&mut content, random);
    }
    content
}

fn once(content: &mut Vec<u8>, random: &mut Random) {
    if content.is_empty() {
        return content.extend(random.bytes(40));
    }
    let is_text = content.iter().take(2000).all(|b| b.is_ascii());
    match (random.below(12), is_text) {
        (0..5, true) => number(content, random),
        (5..7, true) => lines(content, random),
        (7, true) => nest(content, random),
        (0..6, false) => word(content, random),
        (6 | 7, false) => header(content, random),
        (8, _) => part(content, random),
        _ => byte(content, random),
    }
}

/// Runs of bytes for which something holds.
fn runs(content: &[u8], holds: impl Fn(u8) -> bool) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (i, _) in content.iter().enumerate().filter(|(_, b)| holds(**b)) {
        match runs.last_mut() {
            Some(run) if run.end == i => run.end = i + 1,
            _ => runs.push(i..i + 1),
        }
    }
    runs
}

/// Replaces a number in a text, and sometimes all that have the same text.
fn number(content: &mut Vec<u8>, random: &mut Random) {
    let is_part = |b: u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'e');
    let mut numbers = runs(content, is_part);
    numbers.retain(|r| content[r.clone()].iter().any(u8::is_ascii_digit));
    if numbers.is_empty() {
        return byte(content, random);
    }
    let at = numbers[random.below(numbers.len())].clone();
    let long = random.below(40) == 0;
    let other = if long { "7".repeat(1 << random.below(17)) } else { choose(random, &NUMBERS).to_owned() };
    if random.below(8) > 0 {
        drop(content.splice(at, other.bytes()));
        return;
    }
    let all = content[at].to_vec();
    for run in numbers.into_iter().rev() {
        if content[run.clone()] == all && content.len() < 1 << 19 {
            drop(content.splice(run, other.bytes()));
        }
    }
}

/// Removes, repeats or moves a line.
fn lines(content: &mut Vec<u8>, random: &mut Random) {
    let mut lines: Vec<Vec<u8>> = content.split_inclusive(|b| *b == b'\n').map(<[u8]>::to_vec).collect();
    let (at, to) = (random.below(lines.len()), random.below(lines.len()));
    match random.below(5) {
        0 | 1 => drop(lines.remove(at)),
        2 => lines.swap(at, to),
        3 => lines.insert(to, lines[at].clone()),
        _ => {
            let again = vec![lines[at].clone(); 1 << random.below(10)];
            drop(lines.splice(to..to, again));
        }
    }
    *content = lines.concat();
}

/// Puts thousands of brackets around a byte.
fn nest(content: &mut Vec<u8>, random: &mut Random) {
    let (open, close) = NESTS[random.below(NESTS.len())];
    let times = [1, 100, 127, 128, 10_000, 100_000][random.below(6)];
    let at = random.below(content.len());
    let (open, close) = (open.repeat(times), close.repeat(times));
    let inner = content[at];
    drop(content.splice(at..=at, open.bytes().chain([inner]).chain(close.bytes())));
}

/// Overwrites some bytes by a number that is not expected, in either order of bytes.
fn word(content: &mut [u8], random: &mut Random) {
    let value = WORDS[random.below(WORDS.len())];
    let mut bytes = value.to_le_bytes().to_vec();
    bytes.truncate([1, 2, 4, 8][random.below(4)]);
    if random.below(2) == 0 {
        bytes.reverse();
    }
    let at = random.below(content.len());
    content.iter_mut().skip(at).zip(bytes).for_each(|(to, from)| *to = from);
}

/// Damages the beginning, where formats have their text and counts.
fn header(content: &mut Vec<u8>, random: &mut Random) {
    let rest = content.split_off(content.len().min(300));
    if random.below(2) == 0 {
        number(content, random);
    } else {
        byte(content, random);
    }
    content.extend(rest);
}

/// Cuts, leaves out or repeats a part.
fn part(content: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(content.len());
    let to = (at + 1 + random.below(200)).min(content.len());
    match random.below(3) {
        0 => content.truncate(at),
        1 => drop(content.drain(at..to)),
        _ => {
            let again = content[at..to].to_vec();
            drop(content.splice(to..to, again));
        }
    }
}

fn byte(content: &mut Vec<u8>, random: &mut Random) {
    if content.is_empty() {
        return;
    }
    let at = random.below(content.len());
    match random.below(4) {
        0 => content[at] ^= 1 << random.below(8),
        1 => content[at] = random.below(256) as u8,
        2 => drop(content.remove(at)),
        _ => {
            let n = 1 + random.below(8);
            let noise = random.bytes(n);
            drop(content.splice(at..at, noise));
        }
    }
}
