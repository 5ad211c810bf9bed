//! Random functions, and their derivatives, by native code and by the interpreter: equal to the bit.

use super::*;
use crate::diff;
use crate::ir::interpret;
use crate::ir::tests::random::random_function;
use proptest::prelude::*;

/// Compiled whole and in pieces.
fn agree(module: &Module, id: FunctionId, args: &[Scalar]) -> Result<(), TestCaseError> {
    for piece in [Options::PIECE, 1, 5] {
        agree_in_pieces(module, id, args, piece)?;
    }
    Ok(())
}

fn agree_in_pieces(module: &Module, id: FunctionId, args: &[Scalar], piece: usize) -> Result<(), TestCaseError> {
    let expected = interpret::run(module, id, args, interpret::Limits::default());
    let got = Native::with(module, id, Options { piece, ..OPTIONS }).call(args, Limits::default());
    match (&expected, &got) {
        (Ok(expected), Ok(got)) => {
            let equal = expected.iter().zip(got).all(|(a, b)| same(*a, *b));
            prop_assert!(equal, "{expected:?} {got:?}\n{module}");
        }
        (Err(interpret::RunError::Failed(a)), Err(Trap::Failure(b))) => prop_assert_eq!(a, b),
        _ => prop_assert!(false, "{expected:?} {got:?}\n{module}"),
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn native_code_is_the_interpreter(
        bytes in prop::collection::vec(any::<u8>(), 0..400),
        n in -1i64..6,
        x in prop::array::uniform3(-3.0..3.0f64),
        w in prop::array::uniform2(-1.0..1.0f64),
    ) {
        let (mut module, id) = random_function(&bytes, 3, 2);
        let mut args = vec![Scalar::Int(n)];
        args.extend(x.map(Scalar::Real));
        agree(&module, id, &args)?;
        let tangent = diff::tangent(&mut module, id, &[1, 3]).unwrap();
        let pullback = diff::pullback(&mut module, id, &[1, 2, 3], true).unwrap();
        args.extend(w.map(Scalar::Real));
        agree(&module, tangent, &args)?;
        agree(&module, pullback, &args)?;
    }
}
