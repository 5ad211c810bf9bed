//! From the geometry of a file to a scan: cleaned, with normals and a noise.

use super::attributes::Attributes;
use super::clean::{self, Cleaned};
use super::equal::{first_equal, position_key};
use super::error::ScanFault;
use super::far;
use super::normals::OverNeighbourhoods;
use super::options::ReadOptions;
use super::pieces;
use super::raw::RawMesh;
use super::rounded::Rounded;
use super::simplify;
use super::source::{Cleaning, ScanSource};
use super::unit::Unit;
use super::{Scan, noise, normals, stations, surface};
use crate::mesh::{TriangleMesh, retain_marked};
use gml_compiler::number::plain;

/// Cleans a mesh (or a cloud) in memory as if it had been read from a file in millimetres; `name` stands for the path.
///
/// # Errors
/// No vertices, no triangle with an area, a coordinate that is not finite, an index out of range.
pub fn from_mesh(mesh: TriangleMesh, name: &str) -> Result<Scan, ScanFault> {
    let count = mesh.positions.len();
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        if let Some(&index) = triangle.iter().find(|&&index| index as usize >= count) {
            let place = format!("triangle {} (counted from 1)", i + 1);
            return Err(ScanFault::IndexOutOfRange { place, what: "vertex", index: index.into(), count });
        }
    }
    if count == 0 {
        return Err(ScanFault::NoVertices);
    }
    let normals = if mesh.normals.len() == count { mesh.normals } else { Vec::new() };
    let (positions, triangles) = (mesh.positions, mesh.triangles);
    let raw = RawMesh { positions, normals, triangles, ..RawMesh::default() };
    let source = ScanSource { path: name.to_owned(), unit: Unit::Mm.to_string(), ..ScanSource::default() };
    finish(raw, Unit::Mm.millimetres(), source, &ReadOptions::default())
}

/// Cleans what a file has; `unit` is that of its coordinates, in millimetres.
pub(super) fn finish(
    mut raw: RawMesh,
    unit: f64,
    mut source: ScanSource,
    options: &ReadOptions,
) -> Result<Scan, ScanFault> {
    let (gone, far) = far::leave_out(&mut raw, unit, &source.path).unzip();
    let given = !raw.normals.is_empty() || !raw.corner_normals.is_empty();
    let points = raw.positions.len();
    let found = Rounded::find(&raw.positions, &raw.attributes.rounded, &raw.attributes.stations);
    raw.attributes.rounded = found.scaled(unit);
    let sides = raw.sides.take();
    let Cleaned { mut mesh, mut attributes, mut oriented, turned, dropped } =
        clean::clean(&raw.into_millimetres(unit)?)?;
    let cleaning = &mut source.cleaning;
    (cleaning.without_area, cleaning.repeated) = (dropped.without_area as u64, dropped.repeated as u64);
    (cleaning.equal_points, cleaning.unused) = (dropped.equal_points as u64, dropped.unused as u64);
    cleaning.far = gone.unwrap_or(0);
    let coincident = dropped.coincident(points);
    let of_triangles = dropped.warning().map(|dropped| format!("`{}`: {dropped}", source.path));
    let mut warnings: Vec<String> = far.into_iter().chain(of_triangles).collect();
    choose(&mut mesh, &mut attributes, options, cleaning);
    warnings.extend(stations::take_away_impossible(&mesh, &mut attributes.stations, &source.path));
    if !oriented && normals::turn_to_stations(&mut mesh, &attributes.stations) {
        oriented = true;
    }
    if turned {
        warnings.push(
            "the triangles face away from the vertex normals of the same file: they were turned to agree with these"
                .to_owned(),
        );
    }
    let noise = settle_normals(&mut mesh, &mut oriented, given, &mut warnings);
    let cut = sides.map(|sides| sides.warnings(noise, mesh.positions.len(), &source.path));
    warnings.extend(cut.unwrap_or_default());
    attributes.rounded = std::mem::take(&mut attributes.rounded).coarse(&mesh, noise, coincident);
    let noise = noise.max(attributes.rounded.deviation(&mesh.normals));
    warnings.extend(rounded(attributes.rounded.largest(), &source.path));
    if options.surface && mesh.triangles.is_empty() {
        warnings.push(make_surface(&mut mesh, &mut attributes, oriented, &mut source)?.1);
    }
    source.points = mesh.positions.len();
    source.triangles = mesh.triangles.len();
    Ok(Scan { mesh, attributes, oriented, source, noise, warnings })
}

/// Leaves out what the user does not want.
fn choose(mesh: &mut TriangleMesh, attributes: &mut Attributes, options: &ReadOptions, cleaning: &mut Cleaning) {
    if options.drop_outliers {
        cleaning.outliers = pieces::drop_outliers(mesh, attributes) as u64;
    }
    if options.keep_largest {
        cleaning.pieces = pieces::keep_largest(mesh, attributes) as u64;
    }
    if let Some(most) = options.decimate {
        cleaning.decimated = simplify::simplify(mesh, attributes, most) as u64;
    }
}

/// A sentence on coordinates whose steps are coarse.
fn rounded(coarsest: f64, path: &str) -> Option<String> {
    (coarsest > 0.0).then(|| {
        let step = format!("{coarsest:.2e}").parse().map_or_else(|_| plain(coarsest), plain);
        format!(
            "`{path}`: its coordinates are rounded to steps of {step} mm, which are larger than the noise: a face may lie off by half a step, and by a whole one if digits were cut off; export them with more digits, or in double precision"
        )
    })
}

/// Makes triangles of the cloud that a file has, whose points, normals and attributes stay as they are there. Of equal
/// points the first is kept; points that are in no triangle are left out. Returns sentences for the user.
pub(super) fn mesh_cloud(
    mesh: &mut TriangleMesh,
    attributes: &mut Attributes,
    source: &mut ScanSource,
) -> Result<Vec<String>, ScanFault> {
    let count = mesh.positions.len();
    let firsts = first_equal(count, |i| position_key(mesh.positions[i]));
    let kept: Vec<bool> = firsts.iter().zip(0..).map(|(first, i)| *first == i).collect();
    retain_marked(&mut mesh.positions, &kept);
    retain_marked(&mut mesh.normals, &kept);
    attributes.retain_marked(&kept);
    source.cleaning.equal_points += (count - mesh.positions.len()) as u64;
    let mut normals = std::mem::take(&mut mesh.normals);
    let given = !normals.is_empty();
    let raw =
        RawMesh { positions: mesh.positions.clone(), normals: normals.clone(), distinct: true, ..RawMesh::default() };
    let Cleaned { mesh: mut cloud, mut oriented, .. } = clean::clean(&raw)?;
    oriented = oriented || normals::turn_to_stations(&mut cloud, &attributes.stations);
    let mut warnings = Vec::new();
    settle_normals(&mut cloud, &mut oriented, given, &mut warnings);
    let (used, sentence) = make_surface(&mut cloud, attributes, oriented, source)?;
    warnings.push(sentence);
    retain_marked(&mut normals, &used);
    *mesh = TriangleMesh { normals, ..cloud };
    Ok(warnings)
}

/// Makes triangles of a cloud. Returns by point whether it is in one, and a sentence with the counts.
fn make_surface(
    mesh: &mut TriangleMesh,
    attributes: &mut Attributes,
    oriented: bool,
    source: &mut ScanSource,
) -> Result<(Vec<bool>, String), ScanFault> {
    let points = mesh.positions.len();
    let used = surface::triangulate(mesh, attributes, oriented);
    if mesh.triangles.is_empty() {
        return Err(ScanFault::NoSurface { points });
    }
    let unused = used.iter().filter(|used| !**used).count();
    source.cleaning.unused += unused as u64;
    let sentence = format!(
        "`{}`: {} triangles were made of its {points} points (--surface); {unused} points are in none",
        source.path,
        mesh.triangles.len()
    );
    Ok((used, sentence))
}

/// Replaces normals that agree with nothing; returns the noise.
fn settle_normals(mesh: &mut TriangleMesh, oriented: &mut bool, given: bool, warnings: &mut Vec<String>) -> f64 {
    let mut agree = normals::agree(mesh);
    if given && !agree && !mesh.triangles.is_empty() {
        let of_triangles = mesh.vertex_normals();
        let from_file = std::mem::replace(&mut mesh.normals, of_triangles);
        agree = normals::agree(mesh);
        if agree {
            warnings.push("the file's normals point anywhere: those of its triangles count instead".to_owned());
        } else {
            mesh.normals = from_file;
        }
    }
    let noise = noise::estimate(mesh, *oriented && agree);
    // Neighbours in a row show no normals: those of a file, or of triangles, do.
    let unknown = noise.in_rows && !given && mesh.triangles.is_empty();
    if noise.is_thick || unknown || *oriented && !agree {
        let OverNeighbourhoods { normals, sided } = normals::over_neighbourhoods(mesh, noise.one_in);
        mesh.normals = normals;
        if *oriented && !sided {
            *oriented = false;
            let what = match (given, mesh.triangles.is_empty()) {
                (true, _) => "normals of the file",
                (false, true) => "normals that were turned towards the scanner's places",
                (false, false) => "triangles",
            };
            warnings.push(format!(
                "the {what} face any way: they are ignored, and a point belongs to the nearest surface, whichever way it faces"
            ));
        }
    }
    noise.deviation
}
