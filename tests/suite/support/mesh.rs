//! Meshes and clouds that tests read, change and write.

use std::fmt::Write;
use std::path::Path;

/// A scan in memory. Millimetres.
#[derive(Clone, Default)]
pub(crate) struct Mesh {
    pub(crate) positions: Vec<[f64; 3]>,
    pub(crate) normals: Vec<[f64; 3]>,
    pub(crate) triangles: Vec<[usize; 3]>,
}

impl Mesh {
    pub(crate) fn read_obj(path: &Path) -> Self {
        let mut mesh = Self::default();
        for line in std::fs::read_to_string(path).expect("a scan").lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let number = |i: usize| words[i].parse::<f64>().expect("a number");
            let index =
                |i: usize| words[i].split('/').next().and_then(|w| w.parse::<usize>().ok()).expect("an index") - 1;
            match words.first() {
                Some(&"v") => mesh.positions.push([number(1), number(2), number(3)]),
                Some(&"f") => mesh.triangles.push([index(1), index(2), index(3)]),
                _ => {}
            }
        }
        mesh
    }

    pub(crate) fn write_ply(&self, path: &Path) {
        let mut out = format!("ply\nformat ascii 1.0\nelement vertex {}\n", self.positions.len());
        let names = if self.normals.is_empty() { &["x", "y", "z"][..] } else { &["x", "y", "z", "nx", "ny", "nz"] };
        names.iter().for_each(|name| writeln!(out, "property double {name}").expect("text"));
        writeln!(out, "element face {}\nproperty list uchar int vertex_indices\nend_header", self.triangles.len())
            .expect("text");
        for (i, p) in self.positions.iter().enumerate() {
            let all = p.iter().chain(self.normals.get(i).into_iter().flatten());
            writeln!(out, "{}", all.map(|c| format!("{c}")).collect::<Vec<_>>().join(" ")).expect("text");
        }
        for [a, b, c] in &self.triangles {
            writeln!(out, "3 {a} {b} {c}").expect("text");
        }
        std::fs::write(path, out).expect("written");
    }

    pub(crate) fn moved(mut self, to: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        self.positions.iter_mut().for_each(|p| *p = to(*p));
        self
    }

    pub(crate) fn scaled(self, factor: f64) -> Self {
        self.moved(|p| p.map(|c| c * factor))
    }

    pub(crate) fn shifted(self, by: [f64; 3]) -> Self {
        self.moved(|p| std::array::from_fn(|i| p[i] + by[i]))
    }

    /// Turned about x and about z, away from the script's own orientation.
    pub(crate) fn turned(self, x: f64, z: f64) -> Self {
        let ((sx, cx), (sz, cz)) = (x.sin_cos(), z.sin_cos());
        self.moved(|[x, y, z]| {
            let [y, z] = [cx * y - sx * z, sx * y + cx * z];
            [cz * x - sz * y, sz * x + cz * y, z]
        })
    }

    pub(crate) fn kept(self, keep: impl Fn([f64; 3]) -> bool) -> Self {
        let mut number = vec![None; self.positions.len()];
        let mut positions = Vec::new();
        for (i, p) in self.positions.iter().enumerate() {
            if keep(*p) {
                number[i] = Some(positions.len());
                positions.push(*p);
            }
        }
        let triangle = |t: &[usize; 3]| Some([number[t[0]]?, number[t[1]]?, number[t[2]]?]);
        Self { positions, triangles: self.triangles.iter().filter_map(triangle).collect(), ..Self::default() }
    }

    pub(crate) fn with(mut self, other: &Self) -> Self {
        let first = self.positions.len();
        self.positions.extend(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + first)));
        self
    }

    pub(crate) fn flipped(mut self) -> Self {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self
    }

    pub(crate) fn cloud(self) -> Self {
        Self { positions: self.positions, ..Self::default() }
    }

    /// As many of the points, spread over them.
    pub(crate) fn only(self, count: usize) -> Self {
        let step = self.positions.len() as f64 / count as f64;
        Self { positions: (0..count).map(|i| self.positions[(i as f64 * step) as usize]).collect(), ..Self::default() }
    }
}

/// Numbers in -1..1, always the same (SplitMix64).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn draw(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64 * 2.0 - 1.0
    }

    pub(crate) fn point(&mut self, size: [f64; 3]) -> [f64; 3] {
        size.map(|s| s * self.draw())
    }
}
