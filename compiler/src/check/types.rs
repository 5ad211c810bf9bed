//! Types and dimensions.

use std::fmt;
use std::sync::Arc;

/// A rational exponent of length, in lowest terms with a positive denominator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Exponent {
    numerator: i16,
    denominator: i16,
}

impl Exponent {
    /// Zero: no length at all.
    pub const ZERO: Exponent = Exponent { numerator: 0, denominator: 1 };
    /// One: a length.
    pub const ONE: Exponent = Exponent { numerator: 1, denominator: 1 };

    /// `numerator / denominator`; `None` where it is out of range (beyond 1000, or the denominator zero).
    #[must_use]
    pub fn new(numerator: i64, denominator: i64) -> Option<Exponent> {
        if denominator == 0 {
            return None;
        }
        let divisor = i64::try_from(gcd(numerator.unsigned_abs(), denominator.unsigned_abs())).ok()?;
        let sign = denominator.signum();
        let (n, d) = (numerator.checked_div(divisor)?.checked_mul(sign)?, (denominator / divisor).checked_mul(sign)?);
        if n.abs() > 1000 || d > 1000 {
            return None;
        }
        Some(Exponent { numerator: i16::try_from(n).ok()?, denominator: i16::try_from(d).ok()? })
    }

    fn parts(self) -> (i64, i64) {
        (i64::from(self.numerator), i64::from(self.denominator))
    }

    fn add(self, other: Exponent) -> Option<Exponent> {
        let ((a, b), (c, d)) = (self.parts(), other.parts());
        Exponent::new(a * d + c * b, b * d)
    }

    fn negate(self) -> Exponent {
        Exponent { numerator: -self.numerator, denominator: self.denominator }
    }

    fn multiply(self, other: Exponent) -> Option<Exponent> {
        let ((a, b), (c, d)) = (self.parts(), other.parts());
        Exponent::new(a * c, b * d)
    }
}

impl fmt::Display for Exponent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.numerator, self.denominator) {
            (n, 1) => write!(f, "{n}"),
            (n, d) => write!(f, "({n}/{d})"),
        }
    }
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a.max(1) } else { gcd(b, a % b) }
}

/// The physical dimension of a number: a power of length, or an angle, or neither.
///
/// An angle is a number of its own kind: it widens to a bare number wherever one is expected, but not back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Dimension {
    /// The exponent of length; zero for angles.
    pub length: Exponent,
    /// Whether it is an angle.
    pub angle: bool,
}

impl Dimension {
    /// A bare number.
    pub const NONE: Dimension = Dimension { length: Exponent::ZERO, angle: false };
    /// A length.
    pub const LENGTH: Dimension = Dimension { length: Exponent::ONE, angle: false };
    /// An angle.
    pub const ANGLE: Dimension = Dimension { length: Exponent::ZERO, angle: true };

    /// A power of length.
    #[must_use]
    pub fn of_length(length: Exponent) -> Dimension {
        Dimension { length, angle: false }
    }

    /// The unit of values: `mm`, `mm^2`, `rad`, or empty.
    #[must_use]
    pub fn unit(self) -> String {
        if self.angle {
            return "rad".to_owned();
        }
        match self.length.parts() {
            (0, _) => String::new(),
            (1, 1) => "mm".to_owned(),
            _ => format!("mm^{}", self.length),
        }
    }

    /// Whether it is a bare number (an angle is not).
    #[must_use]
    pub fn is_none(self) -> bool {
        self == Dimension::NONE
    }

    /// The dimension of a product: angle times bare number is an angle, angle times length a length, angle times
    /// angle a bare number. `None` where the exponent gets out of range.
    #[must_use]
    pub fn times(self, other: Dimension) -> Option<Dimension> {
        let angle = (self.angle && other.is_none()) || (self.is_none() && other.angle);
        Some(Dimension { length: self.length.add(other.length)?, angle })
    }

    /// The dimension of a quotient: angle over bare number is an angle, angle over angle a bare number.
    #[must_use]
    pub fn over(self, other: Dimension) -> Option<Dimension> {
        let angle = self.angle && other.is_none();
        Some(Dimension { length: self.length.add(other.length.negate())?, angle })
    }

    /// The dimension of a power; an angle's power is a bare number (but for the first, which is an angle).
    #[must_use]
    pub fn power(self, exponent: Exponent) -> Option<Dimension> {
        let angle = self.angle && exponent == Exponent::ONE;
        Some(Dimension { length: self.length.multiply(exponent)?, angle })
    }
}

impl fmt::Display for Dimension {
    /// In the user's words, with an article: `a length`, `an area`, `a bare number`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.angle {
            return f.write_str("an angle");
        }
        match self.length.parts() {
            (0, _) => f.write_str("a bare number"),
            (1, 1) => f.write_str("a length"),
            (2, 1) => f.write_str("an area"),
            (3, 1) => f.write_str("a volume"),
            (-1, 1) => f.write_str("a curvature (1/length)"),
            _ => write!(f, "a length^{}", self.length),
        }
    }
}

/// Index of a closure type: what is called, and the types of what it captured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ClosureId(pub u32);

/// The type of a value. Ints, bools and texts that are known while compiling carry their value in the type; it plays
/// no role in how the value is represented.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Type {
    /// The type of an expression with an error that was reported; compatible with every type. Never in a finished tree.
    Error,
    /// A double.
    Real(Dimension),
    /// A whole number, with its value where it is known.
    Int(Option<i64>),
    /// A truth value likewise.
    Bool(Option<bool>),
    /// A text, where it is known; it has no representation.
    Text(Option<Arc<str>>),
    /// `a..b` of ints: two ints.
    Range(Option<i64>, Option<i64>),
    /// Components in order. Vectors and points are tuples of reals; arrays of functions that differ are tuples too.
    Tuple(Arc<[Type]>),
    /// That many elements of one type.
    Array(Arc<Type>, usize),
    /// Fields in the order in which they were written.
    Record(Arc<[(Arc<str>, Type)]>),
    /// A function value: what it captured, in order (see `typed::Model::closures`).
    Closure(ClosureId),
}

impl Type {
    /// A bare real.
    pub const REAL: Type = Type::Real(Dimension::NONE);
    /// A length.
    pub const LENGTH: Type = Type::Real(Dimension::LENGTH);
    /// An angle.
    pub const ANGLE: Type = Type::Real(Dimension::ANGLE);
    /// An int that is not known while compiling.
    pub const INT: Type = Type::Int(None);
    /// A bool likewise.
    pub const BOOL: Type = Type::Bool(None);

    /// A tuple.
    #[must_use]
    pub fn tuple(components: Vec<Type>) -> Type {
        Type::Tuple(components.into())
    }

    /// `n` reals of one dimension: a vector or point.
    #[must_use]
    pub fn vector(n: usize, dimension: Dimension) -> Type {
        Type::Tuple(vec![Type::Real(dimension); n].into())
    }

    /// The number of elements of an array or a tuple; 0 of all else.
    pub(super) fn count(&self) -> usize {
        match self {
            Type::Array(_, n) => *n,
            Type::Tuple(types) => types.len(),
            _ => 0,
        }
    }

    /// A point in space.
    #[must_use]
    pub fn point3() -> Type {
        Type::vector(3, Dimension::LENGTH)
    }

    /// Whether it is, or contains, [`Type::Error`].
    #[must_use]
    pub fn is_error(&self) -> bool {
        self.any(&mut |ty| *ty == Type::Error)
    }

    /// Whether there is a function in it.
    pub(super) fn has_function(&self) -> bool {
        self.any(&mut |ty| matches!(ty, Type::Closure(_)))
    }

    /// Whether a predicate is true of a component of a tuple, array or record, at any depth; or of another type itself.
    pub(super) fn any(&self, predicate: &mut dyn FnMut(&Type) -> bool) -> bool {
        match self {
            Type::Tuple(types) => types.iter().any(|ty| ty.any(predicate)),
            Type::Array(ty, _) => ty.any(predicate),
            Type::Record(fields) => fields.iter().any(|(_, ty)| ty.any(predicate)),
            ty => predicate(ty),
        }
    }

    /// A type of the same shape with every component of tuples, arrays and records replaced; `None` where one has no
    /// replacement.
    pub(super) fn map(&self, replacement: &dyn Fn(&Type) -> Option<Type>) -> Option<Type> {
        Some(match self {
            Type::Tuple(types) => Type::tuple(types.iter().map(|ty| ty.map(replacement)).collect::<Option<_>>()?),
            Type::Array(ty, n) => Type::Array(ty.map(replacement)?.into(), *n),
            Type::Record(fields) => {
                let fields = fields.iter().map(|(name, ty)| Some((name.clone(), ty.map(replacement)?)));
                Type::Record(fields.collect::<Option<_>>()?)
            }
            ty => replacement(ty)?,
        })
    }

    /// Every int in it made a real; `None` where something in it is not a number.
    pub(super) fn all_real(&self) -> Option<Type> {
        self.map(&|ty| match ty {
            Type::Int(_) => Some(Type::REAL),
            Type::Real(_) | Type::Error => Some(ty.clone()),
            _ => None,
        })
    }

    /// The type without the known values of its ints and bools.
    pub(super) fn forget(&self) -> Type {
        let forget = |ty: &Type| {
            Some(match ty {
                Type::Int(_) => Type::INT,
                Type::Bool(_) => Type::BOOL,
                Type::Range(..) => Type::Range(None, None),
                Type::Text(_) => Type::Text(None),
                other => other.clone(),
            })
        };
        self.map(&forget).unwrap_or(Type::Error)
    }

    /// The type with every dimension mapped.
    pub(super) fn map_dimensions(&self, f: &dyn Fn(Dimension) -> Option<Dimension>) -> Option<Type> {
        self.map(&|ty| match ty {
            Type::Real(d) => Some(Type::Real(f(*d)?)),
            other => Some(other.clone()),
        })
    }
}
