//! A vessel, and meshes of models on any lines.

use super::cup::known;
use super::number::Number;
use super::shapes::{Formula, Handmade};
use crate::mesh::TriangleMesh;
use crate::model::{Model, Partials};
use crate::scan::Scan;
use glam::DVec3;
use gml_compiler::program::Quantity;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::f64::consts::TAU;

/// A closed vessel: radius, height, how far the lid is domed and the wall bulges.
pub(super) struct Vessel;

impl Formula for Vessel {
    fn surface<T: Number>(&self, patch: usize, x: &[T], u: T, v: T) -> [T; 3] {
        let c = T::constant;
        let (radius, height, dome, bulge) = (x[0], x[1], x[2], x[3]);
        let turn = u * c(TAU);
        let revolve = |radius: T, height: T| [radius * turn.cos(), radius * turn.sin(), height];
        match patch {
            0 => revolve(radius + bulge * c(4.0) * v * (c(1.0) - v), height * v),
            1 => revolve(radius * (c(1.0) - v), height + dome * v * (c(2.0) - v)),
            _ => revolve(radius * v, c(0.0)),
        }
    }
}

pub(super) fn vessel(dome: f64, bulge: f64) -> Handmade<Vessel> {
    let rows = [("radius", 40.0), ("height", 100.0), ("dome", dome), ("bulge", bulge)]
        .map(|(name, default)| (name, Quantity::Length, -200.0, 200.0, default));
    Handmade::new(Vessel, &rows, &[("wall", &[0, 1, 3]), ("lid", &[0, 1, 2]), ("bottom", &[0])])
}

/// The lines of a patch's grid by u and by v.
pub(super) type Lines = [Vec<f64>; 2];

pub(super) fn even(count: usize) -> Vec<f64> {
    (0..=count).map(|i| i as f64 / count as f64).collect()
}

/// From 0 to 1, ever denser towards 0.
pub(super) fn denser(count: usize) -> Vec<f64> {
    even(count).into_iter().map(|t| t.powi(3)).collect()
}

/// A mesh of a model at its defaults on the given lines of every patch, with noise along the normals at its vertices.
pub(super) fn meshed(model: &dyn Model, lines: &[Lines], noise: f64, seed: u64) -> Scan {
    let x: Vec<f64> = model.parameters().iter().map(|p| p.default).collect();
    let instance = model.instantiate(&x).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let normal = Normal::new(0.0, noise).unwrap();
    let mut mesh = TriangleMesh::default();
    for (patch, [u, v]) in lines.iter().enumerate() {
        let (first, across) = (mesh.positions.len() as u32, u.len() as u32);
        for v in v {
            for u in u {
                // The normal at a pole is that beside it.
                let beside = v.clamp(1e-6, 1.0 - 1e-6);
                let mut p = [Partials::default()];
                instance.partials(patch, &[*u], &[beside], &mut p).unwrap();
                let n = DVec3::from_array(p[0].du).cross(DVec3::from_array(p[0].dv)).normalize();
                mesh.positions.push((DVec3::from_array(p[0].point) + n * normal.sample(&mut random)).to_array());
                mesh.normals.push(n.to_array());
            }
        }
        for j in 1..v.len() as u32 {
            for i in 1..across {
                let at = |i: u32, j: u32| first + j * across + i;
                mesh.triangles.push([at(i - 1, j - 1), at(i, j - 1), at(i, j)]);
                mesh.triangles.push([at(i - 1, j - 1), at(i, j), at(i - 1, j)]);
            }
        }
    }
    known(mesh, noise)
}
