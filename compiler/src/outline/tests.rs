use super::{OutlineError, Polygon, glyphs, svg_path};
use kurbo::{CubicBez, ParamCurve};
use std::f64::consts::{PI, TAU};

const LIMIT: usize = 4096;

fn path(text: &str, tolerance: f64) -> Vec<Polygon> {
    svg_path(text, tolerance, LIMIT).unwrap_or_else(|e| panic!("{text}: {e:?}"))
}

/// The area that polygons bound on their left.
fn area(polygons: &[Polygon]) -> f64 {
    let doubled = |p: &Polygon| -> f64 {
        (0..p.len()).map(|i| (p[i], p[(i + 1) % p.len()])).map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum()
    };
    polygons.iter().map(doubled).sum::<f64>() / 2.0
}

/// Distance of a point from the lines of a polygon.
fn distance(polygon: &Polygon, x: f64, y: f64) -> f64 {
    let to_line = |i: usize| {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        let along = [b[0] - a[0], b[1] - a[1]];
        let from = [x - a[0], y - a[1]];
        let t = (from[0] * along[0] + from[1] * along[1]) / (along[0] * along[0] + along[1] * along[1]);
        let t = t.clamp(0.0, 1.0);
        (from[0] - t * along[0]).hypot(from[1] - t * along[1])
    };
    (0..polygon.len()).map(to_line).fold(f64::INFINITY, f64::min)
}

/// Numbers that look random, the same in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as usize % n
    }
}

#[test]
fn y_points_upwards_and_the_inside_is_on_the_left() {
    for text in ["M 0 0 H 4 V 3 H 0 Z", "M0,0 v3 h4 v-3", "m 0 0 l 4 0 0 3 -4 0 z"] {
        let polygons = path(text, 0.01);
        assert!(polygons.len() == 1 && (area(&polygons) - 12.0).abs() < 1e-9, "{text}: {polygons:?}");
        assert!(polygons[0].iter().all(|p| p[1] <= 0.0 && p[1] > -3.0 - 1e-9), "{text}: {polygons:?}");
    }
}

#[test]
fn arcs_keep_to_their_ellipse() {
    let tolerance = 0.02;
    let text = "M -30 0 A 30 12 20 0 0 30 0 A 30 12 20 0 0 -30 0 Z";
    let circle = path("M -30 0 a 30 30 0 1 0 60 0 a 30 30 0 1 0 -60 0 Z", tolerance);
    let n = circle[0].len();
    // A regular polygon of n corners.
    assert!((area(&circle) - n as f64 / 2.0 * 900.0 * (TAU / n as f64).sin()).abs() < 1e-6);
    assert!(30.0 * (1.0 - (PI / n as f64).cos()) <= tolerance && n < 100, "{n} corners");
    assert!(circle[0].iter().all(|p| (p[0].hypot(p[1]) - 30.0).abs() < 1e-9));
    let (sin, cos) = (-20.0_f64).to_radians().sin_cos();
    let ellipse = path(text, tolerance);
    // The radii are scaled up so that the arc reaches both ends.
    let scale = (cos / 30.0).hypot(sin / 12.0) * 30.0;
    for k in 0..1000 {
        let a = TAU * f64::from(k) / 1000.0;
        let (x, y) = (30.0 * scale * a.cos(), 12.0 * scale * a.sin());
        let off = distance(&ellipse[0], cos * x - sin * y, sin * x + cos * y);
        assert!(off <= tolerance, "{off} at {a}");
    }
}

#[test]
fn chords_keep_the_tolerance() {
    let mut random = Random(5);
    for _ in 0..200 {
        let mut place = || (random.below(2001) as f64 / 10.0 - 100.0, random.below(1000) as f64 / 10.0 + 0.1);
        let [(x1, y1), (x2, y2), (x, y)] = [place(), place(), place()];
        let curve = CubicBez::new((0.0, 0.0), (x1, y1), (x2, y2), (x, y));
        for tolerance in [0.001, 0.05, 2.0] {
            let mut out = super::Flattening::new(tolerance, LIMIT);
            out.move_to(kurbo::Point::ZERO);
            out.cubic_to(curve);
            let mut chords = out.polygons[0].clone();
            // There and back again: a closed line without a chord of its own.
            chords.extend(out.polygons[0].iter().rev().skip(1).copied());
            for k in 0..=300 {
                let p = curve.eval(f64::from(k) / 300.0);
                let off = distance(&chords, p.x, p.y);
                assert!(off <= tolerance, "{curve:?}: {off} for {tolerance}");
            }
        }
    }
}

#[test]
fn outlines_that_overlap_are_joined_and_holes_run_the_other_way() {
    let two = path("M 0 0 H 4 V 4 H 0 Z M 2 2 H 6 V 6 H 2 Z", 0.01);
    assert!(two.len() == 1 && (area(&two) - 28.0).abs() < 1e-9, "{two:?}");
    let hole = path("M 0 0 H 9 V 9 H 0 Z M 3 3 V 6 H 6 V 3 Z", 0.01);
    assert!(hole.len() == 2 && (area(&hole) - 72.0).abs() < 1e-9, "{hole:?}");
    // The same direction: nothing is taken away by the nonzero rule.
    let none = path("M 0 0 H 9 V 9 H 0 Z M 3 3 H 6 V 6 H 3 Z", 0.01);
    assert!(none.len() == 1 && (area(&none) - 81.0).abs() < 1e-9, "{none:?}");
    // A star of five points that is drawn in one go has no hole.
    let star = path("M 0 -10 L 5.878 8.09 -9.511 -3.09 9.511 -3.09 -5.878 8.09 Z", 0.01);
    assert_eq!(star.iter().map(Vec::len).collect::<Vec<_>>(), [10]);
}

#[test]
fn damaged_paths_are_errors() {
    let other = |text: &str| match svg_path(text, 0.01, LIMIT) {
        Err(OutlineError::Other(message, _)) => message,
        result => panic!("{text}: {result:?}"),
    };
    assert_eq!(other("M 0 0 L 8 O Z"), "the SVG path cannot be read from its character 11 on: 'O Z'");
    assert_eq!(other("M 0 0 L 8"), "the SVG path ends within a command");
    assert_eq!(other(""), "the SVG path is empty");
    assert_eq!(other("M 0 0 H 8"), "the outline encloses nothing that is larger than its tolerance, 0.01 mm");
    assert!(other("M 0 0 H 1e300 V 1 Z").contains("larger than"));
    assert_eq!(svg_path("M 0 0 H 9 V 9 A 4e5 4e5 0 1 0 0 0 Z", 1e-6, LIMIT), Err(OutlineError::TooManyPoints));
    assert_eq!(svg_path(&format!("M 0 0 {}", "h 1 v 1 ".repeat(9999)), 0.01, LIMIT), Err(OutlineError::TooManyPoints));
}

#[test]
fn no_text_stops_the_reader() {
    let sound = "M10-20A5.5 0.3-4 110-.1.5e2Qq3 4 5 6t7 8C1 2 3 4 5 6s9 8 7 6h1e5v-2zL NaN inf 1e308";
    let letters: Vec<char> = "MmLlHhVvCcSsQqTtAaZz0123456789.,-+eE \u{e9}\n".chars().collect();
    let mut random = Random(1);
    for _ in 0..20_000 {
        let mut text: Vec<char> = if random.below(2) == 0 { sound.chars().collect() } else { Vec::new() };
        for _ in 0..random.below(30) {
            let (at, letter) = (random.below(text.len() + 1), letters[random.below(letters.len())]);
            match random.below(3) {
                0 if at < text.len() => _ = text.remove(at),
                _ => text.insert(at, letter),
            }
        }
        let text: String = text.into_iter().collect();
        if let Ok(polygons) = svg_path(&text, 0.01, LIMIT) {
            assert!(area(&polygons) > 0.0, "{text}");
        }
    }
}

/// Areas of letters by integrals over their quadratic curves, from the tables `glyf` and `cmap` with a program of its
/// own, in square em; and the number of contours.
#[test]
fn letters_have_the_areas_that_the_font_gives() {
    let font = dejavu::sans::regular();
    let em2 = 2048.0 * 2048.0;
    for (letter, exact, count) in
        [("I", 301_586.0, 1), ("O", 785_709.583, 2), ("B", 853_955.583, 3), ("8", 770_151.75, 3)]
    {
        let polygons = glyphs(letter, font, LIMIT).expect("the font has it");
        let (area, exact) = (area(&polygons), exact / em2);
        // Chords take off or add up to the tolerance along the outline.
        assert!((area - exact).abs() < 2e-2 * exact, "{letter}: {area}, not {exact}");
        assert_eq!(polygons.len(), count, "{letter}");
    }
    let i = &glyphs("I", font, LIMIT).expect("the font has it")[0];
    assert_eq!(i.iter().map(|p| p[1] * 2048.0).fold(0.0, f64::max), 1493.0);
}

#[test]
fn letters_are_placed_by_advances_and_kerning() {
    let font = dejavu::sans::regular();
    let right = |text: &str| {
        let polygons = glyphs(text, font, LIMIT).expect("the font has it");
        polygons.iter().flatten().map(|p| p[0] * 2048.0).fold(0.0, f64::max).round()
    };
    // The advance of I is 604.
    assert_eq!(right("II"), right("I") + 604.0);
    assert!(right("AV") < right("A") + right("V") - 100.0, "{} {}", right("AV"), right("V"));
}

#[test]
fn fonts_say_what_they_lack() {
    let font = dejavu::sans::regular();
    let other = |text: &str, font: &[u8], limit: usize| match glyphs(text, font, limit) {
        Err(OutlineError::Other(message, _)) => message,
        result => panic!("{text}: {result:?}"),
    };
    assert_eq!(other("a\u{4e2d}", font, LIMIT), "the font has no letter for '\u{4e2d}' (U+4E2D)");
    assert_eq!(other(" ", font, LIMIT), "the text has no letters");
    assert_eq!(other("a", b"no font", LIMIT), "the file is not a font");
    assert_eq!(other("a", &font[..100], LIMIT), other("a", &font[..100], LIMIT));
    assert!(other("a\nb", font, LIMIT).contains("line end"));
    assert_eq!(glyphs("Tower", font, 50), Err(OutlineError::TooManyPoints));
}

#[test]
fn damaged_fonts_stop_nothing() {
    let sound = dejavu::sans::extra_light();
    let mut random = Random(2);
    // The tables of tables and of letters are at the start.
    for round in 0..300 {
        let mut font = sound.to_vec();
        for _ in 0..1 + random.below(200) {
            let at = random.below(if round % 2 == 0 { 2000 } else { font.len() });
            font[at] = random.below(256) as u8;
        }
        font.truncate(if round % 3 == 0 { random.below(font.len()) } else { font.len() });
        if let Ok(polygons) = glyphs("Waffle 8", &font, LIMIT) {
            assert!(area(&polygons) > 0.0);
        }
    }
}
