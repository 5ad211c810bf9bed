//! The model's triangles as shaders read them from the texture of the distances, in tiles.

use super::frame::Frame;
use super::numbers::{list, list_of, number};
use crate::mesh::TriangleMesh;
use crate::variance::Deviations;
use std::fmt::Write;

/// Triangles of a tile. A tile's text takes 3 kB a triangle, a shape that uses it 250 bytes and 2 ms of X_ITE's time
/// when it opens the scene: with 64 the cup's opens in 3.4 s, with 128 in 2.7 s.
const TILE: usize = 128;

/// The most segments an edge is divided into; triangles are made for so many (`DIVIDED_EDGE` of variance::surface).
const MOST_SEGMENTS: f64 = 12.0;

/// The most triangles that are drawn of a model: software renderers take a second for two million.
const MOST_DRAWN: f64 = 2e6;

/// Words of a vertex: two of its position, and two of its texture coordinates and normal.
const VERTEX_WORDS: usize = 4;

/// The most rows of the texture that the model takes, so that with the distances these are no more than every viewer of
/// WebGL 2 and OpenGL 3.3 has been seen to allow, 8,192. A model takes a hundred; a reference mesh may have millions of
/// triangles.
const MOST_ROWS: usize = 4096;

/// A model in tiles.
pub(super) struct Tiles {
    /// Rows of the texture, three bytes a word.
    pub(super) words: Vec<[u8; 3]>,
    /// Words of a plane of vertices, and of one of triangles.
    planes: [usize; 2],
    triangles: usize,
    /// Segments an edge of a triangle.
    segments: usize,
    /// By tile, whether a ray of it met the scan in both directions.
    twice: Vec<bool>,
}

impl Tiles {
    /// Tiles of a mesh with normals and texture coordinates, so fine that every texel has a vertex; none of a mesh that
    /// is too large for a texture.
    pub(super) fn new(mesh: &TriangleMesh, frame: &Frame, deviations: &Deviations) -> Option<Self> {
        let (texels, width) = (deviations.texels.len(), deviations.texels.width as usize);
        let planes = [mesh.positions.len(), mesh.triangles.len()].map(|n| n.next_multiple_of(width));
        let count = VERTEX_WORDS * planes[0] + 3 * planes[1];
        if count / width > MOST_ROWS {
            return None;
        }
        let mut words = vec![[0_u8; 3]; count];
        for i in 0..mesh.positions.len() {
            for (plane, word) in vertex(mesh, frame, i).into_iter().enumerate() {
                words[plane * planes[0] + i] = word;
            }
        }
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            for (which, corner) in triangle.iter().enumerate() {
                let [low, middle, high, _] = corner.to_le_bytes();
                words[VERTEX_WORDS * planes[0] + which * planes[1] + i] = [low, middle, high];
            }
        }
        let triangles = mesh.triangles.len();
        // A triangle of n segments an edge has half of n * n vertices of its own.
        let wanted = (2.0 * texels as f64 / triangles as f64).sqrt().ceil();
        let segments = wanted.min((MOST_DRAWN / triangles as f64).sqrt()).clamp(1.0, MOST_SEGMENTS) as usize;
        Some(Self { words, planes, triangles, segments, twice: twice(mesh, deviations) })
    }

    /// The tile's triangles, divided: a vertex is (triangle, steps to its second corner, steps to its third). A strip
    /// is a row of a triangle, from the edge to the second corner towards the third.
    pub(super) fn tile(&self, out: &mut String) {
        let n = self.segments;
        let rows = (0..=n).flat_map(|j| (0..=n - j).map(move |i| [i, j])).collect::<Vec<_>>();
        let at = |i: usize, j: usize| j * (n + 1) - j * j.saturating_sub(1) / 2 + i;
        out.push_str("<IndexedTriangleStripSet DEF='Tile' solid='false' index='");
        for triangle in 0..TILE {
            for j in 0..n {
                for i in 0..n - j {
                    let _ =
                        write!(out, "{} {} ", triangle * rows.len() + at(i, j), triangle * rows.len() + at(i, j + 1));
                }
                let _ = write!(out, "{} -1 ", triangle * rows.len() + at(n - j, j));
            }
        }
        out.push_str("'><Coordinate point='");
        let vertices = (0..TILE).flat_map(|t| rows.iter().map(move |[i, j]| [t, *i, *j]));
        list(vertices.map(|v| v.map(|c| c.to_string())), out);
        out.push_str("'/></IndexedTriangleStripSet>");
    }

    /// For each tile's shape its first triangle and the hits that it shows, as the translation of a texture and as the
    /// colour of a material.
    pub(super) fn shapes(&self, hits: u8) -> impl Iterator<Item = [String; 2]> {
        let share = |number: usize| number as f64 / f64::from(1_u32 << 24);
        let colour = move |first: usize| format!("{} {:.9} 0", number(share(first), 10), share(usize::from(hits)));
        let firsts = (0..self.triangles).step_by(TILE).zip(&self.twice);
        let firsts = firsts.filter(move |(_, twice)| hits == 0 || **twice).map(|(first, _)| first);
        firsts.map(move |first| [format!("{first} {hits}"), colour(first)])
    }

    /// Fields of the shader: their types, names and values.
    pub(super) fn fields(&self, frame: &Frame) -> Vec<(&'static str, &'static str, String)> {
        let float = |name, value: usize| ("SFFloat", name, value.to_string());
        vec![
            float("vertexPlane", self.planes[0]),
            float("trianglePlane", self.planes[1]),
            float("triangleCount", self.triangles),
            float("segments", self.segments),
            float("tileTriangles", TILE),
            ("SFVec3f", "boxSize", list_of(frame.size.to_array(), frame.decimals)),
        ]
    }

    /// The Transform that makes a tile's box that of the model.
    pub(super) fn transform(&self, frame: &Frame, out: &mut String) {
        let tile = [TILE, self.segments, self.segments].map(|n| n as f64);
        let size = frame.size.to_array();
        let scale: [f64; 3] = std::array::from_fn(|k| size[k] / tile[k]);
        let (scale, corner) = (list_of(scale, 9), list_of(size.map(|s| -s / 2.0), frame.decimals + 2));
        let _ = write!(out, "<Transform scale='{scale}' translation='{corner}'>");
    }
}

/// By tile, whether a texel in the box of one of its triangles has two hits.
fn twice(mesh: &TriangleMesh, deviations: &Deviations) -> Vec<bool> {
    let (width, height) = (deviations.texels.width as usize, deviations.texels.height as usize);
    let mut two = vec![false; width * height];
    for (i, place) in deviations.texels.index.iter().enumerate() {
        two[*place as usize] = !deviations.outward[i].is_nan() && !deviations.inward[i].is_nan();
    }
    let meets = |triangle: &[u32; 3]| {
        let corners = triangle.map(|v| mesh.texcoords[v as usize]);
        // Columns count from the left and rows from the top, as a fraction of a texel that saturates at the sides.
        let columns = corners.map(|[s, _]| (s * width as f64) as usize);
        let rows = corners.map(|[_, t]| ((1.0 - t) * height as f64) as usize);
        let range =
            |at: [usize; 3], count: usize| at[0].min(at[1]).min(at[2])..(at[0].max(at[1]).max(at[2]) + 1).min(count);
        range(rows, height).any(|y| range(columns, width).any(|x| two[y * width + x]))
    };
    mesh.triangles.chunks(TILE).map(|tile| tile.iter().any(meets)).collect()
}

/// The words of a vertex.
fn vertex(mesh: &TriangleMesh, frame: &Frame, i: usize) -> [[u8; 3]; VERTEX_WORDS] {
    let bytes = |share: f64| ((share.clamp(0.0, 1.0) * 65535.0).round() as u16).to_be_bytes();
    let local = frame.local(mesh.positions[i]) / frame.size + 0.5;
    let place = local.to_array().map(bytes);
    let [s, t] = mesh.texcoords[i].map(bytes);
    let [a, b] = octahedral(mesh.normals[i]).map(|c| (127.5 + 127.5 * c).round() as u8);
    [place.map(|b| b[0]), place.map(|b| b[1]), [s[0], t[0], a], [s[1], t[1], b]]
}

/// A unit vector on the octahedron that is unfolded to the square from -1 to 1.
fn octahedral([x, y, z]: [f64; 3]) -> [f64; 2] {
    let sum = (x.abs() + y.abs() + z.abs()).max(f64::MIN_POSITIVE);
    let (x, y) = (x / sum, y / sum);
    if z >= 0.0 {
        return [x, y];
    }
    [(1.0 - y.abs()) * 1f64.copysign(x), (1.0 - x.abs()) * 1f64.copysign(y)]
}
