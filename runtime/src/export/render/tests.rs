use super::{BACKGROUND, Cut, INK, Layer, Paint, TexelColours, View, cut_open, pictures, render};
use crate::export::colormap::diverging;
use crate::export::picture::Picture;
use crate::export::scale::Scale;
use crate::mesh::{Group, TriangleMesh};
use crate::model::{Motion, Texels};
use crate::variance::Deviations;
use glam::DVec3;

const RED: Paint<'static> = Paint::Plain([200, 0, 0]);
const GREEN: Paint<'static> = Paint::Plain([0, 200, 0]);

/// A square of side 2 around the origin at z, seen from above.
fn square(z: f64) -> TriangleMesh {
    TriangleMesh {
        positions: vec![[-1.0, -1.0, z], [1.0, -1.0, z], [1.0, 1.0, z], [-1.0, 1.0, z]],
        texcoords: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    }
}

fn opaque<'a>(mesh: &'a TriangleMesh, paint: Paint<'a>) -> Layer<'a> {
    Layer { mesh, paint, opacity: 1.0 }
}

/// Whether a pixel is rather red or rather green.
fn is_red(pixel: [u8; 3]) -> bool {
    pixel[0] > 100 && pixel[1] < 50
}

#[test]
fn a_triangle_covers_the_pixels_it_should() {
    let mesh = TriangleMesh {
        positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    };
    let picture = render(&[opaque(&mesh, RED)], &View::TOP, 100, 100);
    // The margin is 6 pixels: the square spans 6..94, the triangle is what lies below its diagonal.
    for y in 0..100 {
        for x in 0..100 {
            let pixel = picture.pixels[y * 100 + x];
            let inside = (7..93).contains(&x) && (7..93).contains(&y) && x + y > 101;
            let outside = !(5..95).contains(&x) || !(5..95).contains(&y) || x + y < 97;
            assert!(!inside || is_red(pixel), "{x} {y} is {pixel:?}");
            assert!(!outside || pixel == BACKGROUND, "{x} {y} is {pixel:?}");
        }
    }
    let covered = picture.pixels.iter().filter(|p| is_red(**p)).count() as f64;
    assert!((covered - 88.0 * 88.0 / 2.0).abs() < 88.0, "{covered} pixels");
}

/// A square and a longer one, from above and from the front and above: one scale for all, one centre a view.
#[test]
fn a_sheet_has_one_scale() {
    let small = square(0.0);
    let mut long = square(0.0);
    long.positions.iter_mut().for_each(|p| p[0] = 3.0 + 4.0 * p[0]);
    let side = View { toward: DVec3::new(0.0, -1.0, 1.0), up: DVec3::Z, cut: None };
    let (red, green) = ([opaque(&small, RED)], [opaque(&long, GREEN)]);
    let picture = Picture::sheet(&pictures(&[&red, &green], &[View::TOP, side], 100).0, 2);
    assert_eq!((picture.width, picture.height), (200, 200));
    // Both span 8 mm from -1 to 7: 88 pixels, of which the small one has the first quarter, in both views.
    let row = |y: usize, left: usize| -> Vec<usize> {
        let pixel = |x: usize| picture.pixels[y * 200 + left + x];
        (0..100).filter(|x| pixel(*x) != BACKGROUND && pixel(*x)[2] < 50).collect()
    };
    let ends = |found: &[usize]| (found.first().copied().unwrap_or(0), found.last().copied().unwrap_or(0));
    for left in [0, 100] {
        let (small, long) = (ends(&row(50, left)), ends(&row(150, left)));
        assert!(small.0.abs_diff(6) <= 1 && small.1.abs_diff(27) <= 1, "{small:?}");
        assert!(long.0.abs_diff(6) <= 1 && long.1.abs_diff(93) <= 1, "{long:?}");
    }
}

#[test]
fn the_nearer_hides_the_farther_whatever_the_order() {
    let (high, low) = (square(1.0), square(-1.0));
    let middle = |layers: &[Layer<'_>], view: &View| render(layers, view, 20, 20).pixels[10 * 20 + 10];
    let below = View { toward: DVec3::NEG_Z, ..View::TOP };
    for layers in [[opaque(&high, RED), opaque(&low, GREEN)], [opaque(&low, GREEN), opaque(&high, RED)]] {
        assert!(is_red(middle(&layers, &View::TOP)));
        assert!(!is_red(middle(&layers, &below)));
    }
    // The same within one mesh.
    let mut both = square(-1.0);
    both.positions.extend(square(1.0).positions);
    both.triangles.extend([[4, 5, 6], [4, 6, 7]]);
    let colours: Vec<[u8; 3]> = [[0, 200, 0]; 4].into_iter().chain([[200, 0, 0]; 4]).collect();
    assert!(is_red(middle(&[opaque(&both, Paint::Vertices(&colours))], &View::TOP)));
    assert!(!is_red(middle(&[opaque(&both, Paint::Vertices(&colours))], &below)));
}

#[test]
fn a_cut_view_shows_what_is_behind() {
    let (high, low) = (square(1.0), square(-1.0));
    let cut = View { cut: Some(Cut { normal: DVec3::Z, through: None }), ..View::TOP };
    let picture = render(&[opaque(&high, RED), opaque(&low, GREEN)], &cut, 20, 20);
    let [r, g, _] = picture.pixels[10 * 20 + 10];
    assert!(g > 100 && r < 50);
}

/// The plane of a cut may be oblique to the eye: of two walls what is behind it is left, with the outline in front.
#[test]
fn a_cut_may_be_oblique() {
    let wall = |x: f64| {
        let positions = vec![[x, -1.0, -1.0], [x, 1.0, -1.0], [x, 1.0, 1.0], [x, -1.0, 1.0]];
        TriangleMesh { positions, ..square(0.0) }
    };
    let mut walls = wall(-1.0);
    walls.positions.extend(wall(1.0).positions);
    walls.triangles.extend([[4, 5, 6], [4, 6, 7]]);
    let cut = Some(Cut { normal: DVec3::NEG_Y, through: Some(DVec3::ZERO) });
    let view = View { toward: DVec3::new(0.3, -1.0, 0.5), up: DVec3::Z, cut };
    let whole = render(&[opaque(&walls, RED)], &View { cut: None, ..view }, 80, 80);
    let half = render(&[opaque(&walls, RED)], &view, 80, 80);
    let count = |picture: &Picture, seen: &dyn Fn([u8; 3]) -> bool| picture.pixels.iter().filter(|p| seen(**p)).count();
    let [all, rest] = [&whole, &half].map(|picture| count(picture, &is_red));
    // A half of each wall; the outline hides some of it.
    assert!((2 * all / 5..3 * all / 5).contains(&rest), "{rest} of {all}");
    assert!(count(&half, &|pixel| pixel == INK) > 80, "the outline");
}

/// A cylinder about an axis, with a fin on one side of it, is cut along its axis and through the fin.
#[test]
fn a_cut_contains_the_axis() {
    let (axis, across, other) = (DVec3::X, DVec3::new(0.0, 0.6, 0.8), DVec3::new(0.0, -0.8, 0.6));
    let centre = DVec3::new(5.0, -3.0, 2.0);
    let mut mesh = TriangleMesh::default();
    for i in 0..48 {
        let turn = f64::from(i) * std::f64::consts::TAU / 48.0;
        let rim = centre + 10.0 * (turn.cos() * across + turn.sin() * other);
        mesh.positions.extend([rim - 30.0 * axis, rim + 30.0 * axis].map(|p| p.to_array()));
        let [a, b, c, d] = [2 * i, 2 * i + 1, 2 * ((i + 1) % 48), 2 * ((i + 1) % 48) + 1].map(|v: i32| v as u32);
        mesh.triangles.extend([[a, c, b], [b, c, d]]);
    }
    let (cylinder, fin) = (mesh.clone(), centre + 10.0 * across);
    mesh.positions.extend([fin, fin + 40.0 * across, fin + 40.0 * axis].map(|p| p.to_array()));
    mesh.triangles.push([96, 97, 98]);
    let group = |name: &str, start, end| Group { name: name.to_owned(), start, end };
    mesh.groups = vec![group("cylinder", 0, 96), group("fin", 96, 97)];
    let view = cut_open(&mesh, &Motion::IDENTITY.rotation);
    let cut = view.cut.expect("a cut");
    let through = cut.through.expect("a point") - centre;
    // All is exact but for rounding.
    assert!(cut.normal.dot(axis).abs() < 1e-6 && cut.normal.dot(through).abs() < 1e-6, "{cut:?}");
    assert!(cut.normal.dot(across).abs() < 1e-6 && view.toward.dot(cut.normal) > 0.5, "{view:?}");
    // Without the fin the cut faces the front.
    let cut = cut_open(&cylinder, &Motion::IDENTITY.rotation).cut.expect("a cut");
    assert!((cut.normal - DVec3::NEG_Y).length() < 1e-6, "{cut:?}");
}

/// A bent pipe has no axis of its own: a quarter of a torus and a straight end are cut in the plane of the bend.
#[test]
fn a_bent_pipe_is_cut_in_its_plane() {
    let mut mesh = TriangleMesh::default();
    let ring = |middle: DVec3, out: DVec3| {
        (0..24).map(move |i| {
            let turn = f64::from(i) * std::f64::consts::TAU / 24.0;
            (middle + 10.0 * (turn.cos() * out + turn.sin() * DVec3::Y)).to_array()
        })
    };
    // From the height of -60 upwards, then by a quarter turn towards +x about (40, y, 0).
    let straight = (0..=12).map(|k| (DVec3::new(0.0, 0.0, -60.0 + 5.0 * f64::from(k)), DVec3::NEG_X));
    let bend = (1..=12).map(|k| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_2 / 12.0).sin_cos();
        (DVec3::new(40.0 - 40.0 * cos, 0.0, 40.0 * sin), DVec3::new(-cos, 0.0, sin))
    });
    let rings: Vec<(DVec3, DVec3)> = straight.chain(bend).collect();
    rings.iter().for_each(|(middle, out)| mesh.positions.extend(ring(*middle, *out)));
    for k in 0..rings.len() as u32 - 1 {
        for i in 0..24 {
            let [a, b] = [i, (i + 1) % 24].map(|i| 24 * k + i);
            mesh.triangles.extend([[a, b, a + 24], [b, b + 24, a + 24]]);
        }
    }
    let group = |name: &str, start, end| Group { name: name.to_owned(), start, end };
    mesh.groups = vec![group("straight", 0, 576), group("bend", 576, 1152)];
    let cut = cut_open(&mesh, &Motion::IDENTITY.rotation).cut.expect("a cut");
    // The diagonals of the quadrilaterals are not symmetric.
    assert!((cut.normal - DVec3::NEG_Y).length() < 0.02, "{cut:?}");
}

#[test]
fn translucent_layers_let_through() {
    let (high, low) = (square(1.0), square(-1.0));
    let glass = Layer { opacity: 0.5, ..opaque(&high, RED) };
    for layers in [[glass, opaque(&low, GREEN)], [opaque(&low, GREEN), glass]] {
        let [r, g, _] = render(&layers, &View::TOP, 20, 20).pixels[10 * 20 + 10];
        assert!(r.abs_diff(g) < 3 && r > 50, "{r} {g}");
    }
    let hidden = Layer { opacity: 0.5, ..opaque(&low, RED) };
    assert!(!is_red(render(&[opaque(&high, GREEN), hidden], &View::TOP, 20, 20).pixels[210]));
}

#[test]
fn deviations_lie_where_their_texels_are() {
    // Upper left outside, lower right inside, upper right without data, lower left without a chart.
    let texels = Texels {
        width: 2,
        height: 2,
        index: vec![0, 1, 3],
        part: vec![0; 3],
        position: vec![[0.0; 3]; 3],
        normal: vec![[0.0, 0.0, 1.0]; 3],
        area: vec![1.0; 3],
        side: vec![1.0; 3],
        part_names: vec!["a".to_owned()],
    };
    let deviations = Deviations::new(texels, 2.0, vec![1.0, f32::NAN, f32::NAN], vec![f32::NAN, f32::NAN, 1.0]);
    let colours = TexelColours::new(&deviations, &Scale::continuous(1.0));
    assert_eq!(colours.at(0.1, 0.9), Some(diverging(1.0)));
    assert_eq!(colours.at(0.9, 0.9), None);
    assert_eq!(colours.at(0.9, 0.1), Some(diverging(-1.0)));
    assert_eq!(colours.at(0.1, 0.1), Some(diverging(1.0)), "of equally near texels the first");
    let mesh = square(0.0);
    let picture = render(&[opaque(&mesh, Paint::Texels(&colours))], &View::TOP, 40, 40);
    let (upper_left, lower_right) = (picture.pixels[10 * 40 + 10], picture.pixels[30 * 40 + 30]);
    assert!(upper_left[0] > 2 * upper_left[2] && lower_right[2] > 2 * lower_right[0]);
}

#[test]
fn a_turned_model_looks_as_before() {
    let mut mesh = square(0.3);
    mesh.positions[2] = [0.4, 0.9, 0.7];
    let turn = [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]];
    let turned =
        TriangleMesh { positions: mesh.positions.iter().map(|p| [-p[1], -p[2], p[0]]).collect(), ..mesh.clone() };
    let before = render(&[opaque(&mesh, RED)], &View::FRONT, 50, 40);
    let after = render(&[opaque(&turned, RED)], &View::FRONT.of_turned(&turn), 50, 40);
    let different = before.pixels.iter().zip(&after.pixels).filter(|(a, b)| a[0].abs_diff(b[0]) > 8).count();
    assert!(different < 8, "{different} pixels: only edges may round differently");
    assert_eq!(View::BACK.of_turned(&Motion::IDENTITY.rotation), View::BACK);
}

#[test]
fn nothing_and_nonsense_are_drawn_as_background() {
    let mut bad = square(0.0);
    bad.positions[2] = [f64::NAN, 1e308, -1e308];
    bad.triangles.push([0, 1, 99]);
    bad.triangles.push([0, 0, 0]);
    let picture = render(&[opaque(&bad, RED), opaque(&TriangleMesh::default(), GREEN)], &View::FRONT, 30, 20);
    assert!(picture.pixels.iter().all(|p| *p == BACKGROUND));
    assert!(render(&[], &View { toward: DVec3::ZERO, ..View::TOP }, 3, 3).pixels.iter().all(|p| *p == BACKGROUND));
    assert!(render(&[], &View::TOP, 0, 0).pixels.is_empty());
}
