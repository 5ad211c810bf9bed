//! Scripts that try to take the compiler with them: each must end soon, with an error.

use super::support::{check_text, check_with, rendered};
use crate::check::CheckOptions;
use std::collections::BTreeMap;
use std::time::Instant;

fn assert_refused(text: &str, word: &str) {
    let start = Instant::now();
    let (model, sources, diagnostics) = check_text(text);
    let said = rendered(&sources, &diagnostics);
    assert!(model.is_none() && said.contains(word), "{said}");
    // Far beyond what it takes here, far below what a person would call a hang.
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}

#[test]
fn recursion_without_end() {
    assert_refused("fn f(n: int) = f(n + 1)\nfn g() = f(0)", "nested more than 400 deep");
    assert_refused("fn f(x) = f((x, x))\nfn g() = f(0)", "error");
    assert_refused("fn f(x) = f(|y| x(y))\nfn g() = f(|y| y)", "nested more than");
    assert_refused("fn f(n: int) = f(n + 1) + f(n + 2)\nfn g() = f(0)", "error");
    assert_refused("fn a(x) = b(x)\nfn b(x) = a(x)\nfn g() = a(1)", "calls itself");
    assert_refused("let a = a\nfn g() = a", "in terms of itself");
}

#[test]
fn growth_without_end() {
    let mut text = "fn g() = { let a0 = (1.5, 2.5)\n".to_owned();
    for i in 0..60 {
        text.push_str(&format!("let a{} = (a{i}, a{i})\n", i + 1));
    }
    text.push_str("a60 }");
    assert_refused(&text, "grows beyond");
    let mut text = "fn g() = { let f0 = |x| x + 1\n".to_owned();
    for i in 0..60 {
        text.push_str(&format!("let f{} = |x| f{i}(f{i}(x))\n", i + 1));
    }
    text.push_str("f60(0.5) }");
    // Every function is instantiated once for its one type of argument: that is no growth.
    let (_, _, diagnostics) = check_text(&text);
    assert!(diagnostics.is_empty());
    assert_refused(&text.replace("f60(0.5)", "f60(0)"), "error");
    let nest = "for i in 0..4000 { for j in 0..4000 { for k in 0..4000 { i * j * k } } }";
    assert_refused(&format!("fn g() = {nest}"), "error");
    assert_refused("fn g() = for i in 0..9223372036854775807 { i }", "iterations");
    assert_refused("fn g() = for i in -9223372036854775807..9223372036854775807 { i }", "iterations");
    assert_refused("fn g() = 9223372036854775807 + 1", "too large");
}

#[test]
fn limits_are_options() {
    let fib = "fn count(n: int) = if n == 0 { 0 } else { 1 + count(n - 1) }\nfn g() = count(30)";
    let options = CheckOptions { depth: 20, ..CheckOptions::default() };
    let (_, sources, diagnostics) = check_with(fib, &BTreeMap::new(), &options);
    assert!(rendered(&sources, &diagnostics).contains("nested more than 20 deep"));
    let (_, _, diagnostics) = check_text(fib);
    assert!(diagnostics.is_empty());
}

#[test]
fn broken_text_never_panics() {
    let cup = include_str!("../../../../examples/cup/cup.gml");
    let mut state = 1u64;
    let mut random = |n: usize| {
        // Numerical Recipes' linear congruential generator.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    let words =
        ["(", ")", "|t|", "{", "}", "mm", "'", "..", "for i in 0..3 { i }", "-", "^", "r", "1e400", "0", "if", "part"];
    for _ in 0..300 {
        let mut text = cup.to_owned();
        for _ in 0..1 + random(3) {
            let (at, length) = (random(text.len()), random(12));
            let (start, end) = (text.floor_char_boundary(at), text.ceil_char_boundary((at + length).min(text.len())));
            let word = if random(2) == 0 { "" } else { words[random(words.len())] };
            text.replace_range(start..end, word);
        }
        check_text(&text);
    }
}
