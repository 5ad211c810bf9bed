//! The known name that is nearest to an unknown one.

use std::cmp::Reverse;

/// The distance of a candidate from the name, the most important first: edits, whether they differ in more than doubled
/// letters, length of the common prefix (longer is nearer), kind, difference in length.
type Distance = (usize, bool, Reverse<usize>, usize, usize);

/// The candidate that was most likely meant, of several kinds, the likeliest kind first.
///
/// A candidate is at most a third of the name's length away in edits (optimal string alignment: insertion, deletion,
/// substitution, transposition), but one edit always counts as near. If there is none, a name of three letters or more
/// stands for the only candidate that begins with it.
pub(crate) fn nearest_of<'c>(name: &str, kinds: &[&[&'c str]]) -> Option<&'c str> {
    let folded = fold(name);
    let length = folded.chars().count();
    let limit = (length / 3).max(1);
    let mut best: Option<(Distance, &'c str)> = None;
    for (kind, candidates) in kinds.iter().enumerate() {
        for candidate in candidates.iter().filter(|c| **c != name) {
            let other = fold(candidate);
            let count = other.chars().count();
            if count.abs_diff(length) > limit {
                continue;
            }
            let distance = strsim::osa_distance(&folded, &other);
            if distance > limit || distance >= count || distance >= length {
                continue;
            }
            let shared = folded.chars().zip(other.chars()).take_while(|(a, b)| a == b).count();
            let differ = without_doubles(&folded) != without_doubles(&other);
            let nearness = (distance, differ, Reverse(shared), kind, count.abs_diff(length));
            if best.is_none_or(|(m, c)| (nearness, *candidate) < (m, c)) {
                best = Some((nearness, candidate));
            }
        }
    }
    best.map(|(_, candidate)| candidate).or_else(|| beginning(&folded, kinds))
}

/// The candidate that was most likely meant, of one kind; None where no candidate is near.
pub fn nearest<'c>(name: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<&'c str> {
    let candidates: Vec<&str> = candidates.into_iter().collect();
    nearest_of(name, &[&candidates])
}

/// The only candidate that begins with the whole name, if the name is long enough.
fn beginning<'c>(folded: &str, kinds: &[&[&'c str]]) -> Option<&'c str> {
    if folded.chars().count() < 3 {
        return None;
    }
    let mut candidates = kinds.iter().flat_map(|k| k.iter()).filter(|c| fold(c).starts_with(folded));
    let first = candidates.next()?;
    candidates.all(|other| other == first).then_some(*first)
}

fn without_doubles(name: &str) -> Vec<char> {
    let mut letters: Vec<char> = name.chars().collect();
    letters.dedup();
    letters
}

/// Lower case; bounded, because the search takes quadratic time.
fn fold(name: &str) -> String {
    name.chars().take(64).flat_map(char::to_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_found_and_strangers_are_not() {
        assert_eq!(nearest("bezeir", ["line", "bezier", "circle"]), Some("bezier"));
        assert_eq!(nearest("Rim", ["rim", "r"]), Some("rim"));
        assert_eq!(nearest("lenght", ["length"]), Some("length"));
        assert_eq!(nearest("q", ["x", "y"]), None);
        assert_eq!(nearest("wheel", ["line", "bezier"]), None);
    }

    #[test]
    fn the_beginning_decides_between_equals() {
        assert_eq!(nearest("sinn", ["sign", "sin", "sinh"]), Some("sin"));
        assert_eq!(nearest("clmap", ["clap", "clamp"]), Some("clamp"));
        assert_eq!(nearest("coss", ["cross", "cos", "cosh"]), Some("cos"));
        assert_eq!(nearest("raduis", ["radians", "radius"]), Some("radius"));
    }

    #[test]
    fn likely_kinds_go_before_others_that_are_as_near() {
        assert_eq!(nearest_of("hight", &[&["right"], &["light"]]), Some("right"));
    }

    #[test]
    fn beginnings_of_one_name_are_found() {
        assert_eq!(nearest("rad", ["radius", "height"]), Some("radius"));
        assert_eq!(nearest("ra", ["radius", "height"]), None);
        assert_eq!(nearest("out", ["outer", "outside"]), None);
    }
}
