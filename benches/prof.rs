//! profiling
use gml_compiler::program::{EmitStage, Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::time::Instant;
fn main() {
    let mut args = std::env::args().skip(1);
    let path = args.next().unwrap();
    let n: usize = args.next().unwrap().parse().unwrap();
    let what = args.next().unwrap_or_default();
    let text = std::fs::read_to_string(&path).unwrap();
    let make = || {
        let s = SourceFile { name: path.clone(), text: text.clone() };
        compile(s, &NoFiles, &Options::default()).unwrap().program
    };
    let p = make();
    match what.as_str() {
        "asm" => return print!("{}", p.emit(EmitStage::Asm)),
        "clif" => return print!("{}", p.emit(EmitStage::Clif)),
        "ir" => return print!("{}", p.emit(EmitStage::Ir)),
        "run" => return run(&p),
        _ => {}
    }
    for _ in 0..n {
        std::hint::black_box(make().parts().len());
    }
}
fn run(p: &Program) {
    let x = p.defaults();
    let inst = p.instantiate(&x).unwrap();
    let (mut u, mut v) = (vec![], vec![]);
    for i in 0..128 {
        for j in 0..64 {
            u.push((i as f64 + 0.5) / 128.0);
            v.push((j as f64 + 0.5) / 64.0);
        }
    }
    let n = u.len();
    let w = vec![[1.0, 0.5, 0.25]; n];
    for (k, part) in p.parts().iter().enumerate() {
        let mut out = vec![0.0; n * 3 * part.active.len().max(6)];
        let mut times = vec![];
        for which in 0..5 {
            let mut best = f64::INFINITY;
            for _ in 0..30 {
                let t = Instant::now();
                match which {
                    0 => inst.points(k, &u, &v, &mut out[..3 * n]).unwrap(),
                    1 => inst.partials(k, &u, &v, &mut out[..9 * n]).unwrap(),
                    2 => inst.second_partials(k, &u, &v, &mut out[..18 * n]).unwrap(),
                    3 => inst.jacobian(k, &u, &v, &mut out[..3 * part.active.len() * n]).unwrap(),
                    _ => {
                        let mut g = vec![0.0; x.len()];
                        inst.pullback(k, &u, &v, &w, &mut g).unwrap()
                    }
                }
                best = best.min(t.elapsed().as_secs_f64() * 1e9 / n as f64);
            }
            times.push(format!("{best:8.1}"));
        }
        println!("{:16} ns/point: {}", part.name, times.join(" "));
    }
    let mut best = f64::INFINITY;
    for _ in 0..30 {
        let t = Instant::now();
        std::hint::black_box(p.instantiate(&x).unwrap().x());
        best = best.min(t.elapsed().as_secs_f64() * 1e6);
    }
    println!("instantiate {best:.1} us");
}
