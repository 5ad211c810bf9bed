//! Measures the hierarchy and the ray casting on a scan:
//! `cargo run --release -p gml-runtime --example ray_casting -- SCAN [SIDE [DEVICE]]`.
//!
//! Casts from side x side points on the scan's own surface, displaced by up to 1 mm, along its normal in both
//! directions up to 5 mm. Points follow the triangles' order, so that neighbours are near each other, as in a texture.

use glam::DVec3;
use gml_runtime::bvh::Bvh;
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::Texels;
use gml_runtime::scan::{self, ReadOptions};
use gml_runtime::variance::{Device, DistanceTexture, Facing, Statistics, trace};
use rayon::prelude::*;
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("which scan?")?;
    let side: u32 = arguments.next().map_or(Ok(2048), |s| s.parse())?;
    let device = match arguments.next().as_deref() {
        None | Some("cpu") => Device::Cpu,
        Some("gpu") => Device::Gpu,
        Some(other) => return Err(format!("no such device: {other}").into()),
    };
    let mesh = scan::read(path.as_ref(), &ReadOptions::default())?.mesh;
    println!("{} triangles, {} threads", mesh.triangles.len(), rayon::current_num_threads());

    let start = Instant::now();
    let bvh = Bvh::build(&mesh)?;
    println!("build: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);

    let texels = points_on(&mesh, side);
    let count = f64::from(side) * f64::from(side);
    let start = Instant::now();
    let found = trace(texels, &bvh, 5.0, Facing::SAME, device)?;
    let seconds = start.elapsed().as_secs_f64();
    println!("{}: {:.3} s, {:.2} M rays/s", found.device, seconds, 2e-6 * count / seconds);
    if let Some(notice) = found.notice {
        println!("{notice}");
    }

    let start = Instant::now();
    let statistics = Statistics::of(&found.deviations);
    println!("statistics: {:.3} s; mean {:.4} mm", start.elapsed().as_secs_f64(), statistics.weighted.mean);
    let start = Instant::now();
    let texture = DistanceTexture::new(&found.deviations);
    println!("texture: {:.3} s, {} bytes", start.elapsed().as_secs_f64(), texture.rgb.len());

    let positions = &found.deviations.texels.position;
    let start = Instant::now();
    let total: f64 =
        positions.par_iter().filter_map(|p| bvh.closest_point(*p, 5.0)).map(|closest| closest.distance).sum();
    let seconds = start.elapsed().as_secs_f64();
    println!("closest points: {:.2} M/s; mean {:.4} mm", 1e-6 * count / seconds, total / count);
    Ok(())
}

/// Points on the triangles, displaced by up to 1 mm.
fn points_on(mesh: &TriangleMesh, side: u32) -> Texels {
    let count = side as usize * side as usize;
    let golden = |i: usize, k: f64| (i as f64 * k).fract();
    let (position, normal): (Vec<_>, Vec<_>) = (0..count)
        .map(|i| {
            let triangle = mesh.triangles[(i as u128 * mesh.triangles.len() as u128 / count as u128) as usize];
            let [a, b, c] = triangle.map(|v| DVec3::from(mesh.positions[v as usize]));
            let (u, v) = (golden(i, 0.754_877_666), golden(i, 0.569_840_291));
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let n = (b - a).cross(c - a).normalize();
            let p = a + (b - a) * u + (c - a) * v + n * (2.0 * golden(i, 0.618_033_989) - 1.0);
            (p.to_array(), n.as_vec3().to_array())
        })
        .unzip();
    Texels {
        width: side,
        height: side,
        index: (0..count as u32).collect(),
        part: vec![0; count],
        position,
        normal,
        area: vec![1.0; count],
        part_names: vec!["surface".to_owned()],
    }
}
