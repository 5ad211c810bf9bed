//! Derivative programs as people read them.

use super::super::*;
use crate::ir::print::gml;
use crate::ir::tests::{function_of, reals};
use crate::ir::{Unary, inline};

fn jacobian_text(module: &mut Module, f: FunctionId, wrt: &[u32]) -> String {
    let (id, _) = jacobian(module, f, wrt).unwrap();
    gml(module, id)
}

#[test]
fn a_cube() {
    let (mut module, f) = function_of(&["x"], |b, p| {
        let three = b.real(3.0);
        b.pow(p[0], three)
    });
    insta::assert_snapshot!(jacobian_text(&mut module, f, &[0]));
    let back = pullback(&mut module, f, &[0], false).unwrap();
    insta::assert_snapshot!(gml(&module, back));
    let twice = tangent(&mut module, f, &[0]).unwrap();
    let (twice, _) = jacobian(&mut module, twice, &[0]).unwrap();
    insta::assert_snapshot!(gml(&module, twice));
}

#[test]
fn the_outer_profile_of_the_cup() {
    let (mut module, f) = function_of(&["t", "shape", "h"], |b, p| {
        let three = b.real(3.0);
        let exponent = b.add(three, p[1]);
        let power = b.pow(p[0], exponent);
        b.mul(p[2], power)
    });
    insta::assert_snapshot!(jacobian_text(&mut module, f, &[0, 1, 2]));
}

#[test]
fn a_cubic_by_de_casteljau() {
    let (mut module, f) = function_of(&["p0", "p1", "p2", "p3", "t"], |b, p| {
        let mut points = p[..4].to_vec();
        while points.len() > 1 {
            points = (points.windows(2))
                .map(|w| {
                    let difference = b.sub(w[1], w[0]);
                    let step = b.mul(p[4], difference);
                    b.add(w[0], step)
                })
                .collect();
        }
        points[0]
    });
    insta::assert_snapshot!(jacobian_text(&mut module, f, &[4]));
    insta::assert_snapshot!(jacobian_text(&mut module, f, &[1]));
}

#[test]
fn a_norm_and_a_rotation() {
    let (mut module, f) = function_of(&["x", "y", "angle"], |b, p| {
        let (xx, yy) = (b.mul(p[0], p[0]), b.mul(p[1], p[1]));
        let square = b.add(xx, yy);
        let norm = b.unary(Unary::Sqrt, square);
        let cos = b.unary(Unary::Cos, p[2]);
        b.mul(norm, cos)
    });
    insta::assert_snapshot!(jacobian_text(&mut module, f, &[0, 1, 2]));
}

#[test]
fn a_loop_and_a_branch() {
    // s = x; for i in 0..n { s = s * x + i }; if s < 1 { sin(s) } else { exp(s) }
    let mut module = Module::default();
    let params = vec![Parameter::new("i", Type::Int), Parameter::real("s"), Parameter::real("x")];
    let mut b = FunctionBuilder::new("turn", params);
    let product = b.mul(b.param(1), b.param(2));
    let i = b.unary(Unary::ToReal, b.param(0));
    let s = b.add(product, i);
    let turn = module.add(b.finish([("s".to_owned(), s)]));
    let sides = [Unary::Sin, Unary::Exp].map(|op| {
        let mut b = FunctionBuilder::new("side", reals(&["s"]));
        let r = b.unary(op, b.param(0));
        module.add(b.finish([("r".to_owned(), r)]))
    });
    let mut b = FunctionBuilder::new("f", vec![Parameter::new("n", Type::Int), Parameter::real("x")]);
    let (n, x) = (b.param(0), b.param(1));
    let s = b.loop_(n, turn, vec![x], vec![x])[0];
    let one = b.real(1.0);
    let c = b.compare(ir::Compare::Lt, s, one);
    let r = b.if_(c, sides[0], sides[1], vec![s], &[Type::Real])[0];
    let f = module.add(b.finish([("r".to_owned(), r)]));
    inline(&mut module, &[f]).unwrap();
    insta::assert_snapshot!(jacobian_text(&mut module, f, &[1]));
    let back = pullback(&mut module, f, &[1], true).unwrap();
    insta::assert_snapshot!(gml(&module, back));
}
