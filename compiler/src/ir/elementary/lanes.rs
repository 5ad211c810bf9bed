//! Lanes: one double or several side by side.

use std::ops::{Add, Mul, Sub};

/// One or more doubles that undergo the same operations. In a mask all bits of a lane are set, or none.
pub(crate) trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// The same number in all lanes.
    fn all(x: f64) -> Self;

    /// self * b + c, rounded once.
    fn times_plus(self, b: Self, c: Self) -> Self;

    /// Bitwise and.
    fn and(self, other: Self) -> Self;

    /// Bitwise or.
    fn or(self, other: Self) -> Self;

    /// Bitwise exclusive or.
    fn xor(self, other: Self) -> Self;

    /// Wrapping sum of the bits as integers.
    fn plus_bits(self, other: Self) -> Self;

    /// Wrapping difference of the bits as integers.
    fn minus_bits(self, other: Self) -> Self;

    /// Bits shifted up.
    fn up<const N: i32>(self) -> Self;

    /// Bits shifted down, with zeros from above.
    fn down<const N: i32>(self) -> Self;

    /// The mask of the lanes in which this is less than the other; not where either is NaN.
    fn below(self, other: Self) -> Self;

    /// Whether a mask holds in all lanes.
    fn everywhere(self) -> bool;

    /// Gathers entries of a table at the lowest bits of an index; N is a power of two.
    fn entries<const W: usize, const N: usize>(table: &[[f64; W]; N], index: Self) -> [Self; W];

    /// Applies a function lane by lane.
    fn each(self, f: fn(f64) -> f64) -> Self;

    /// Applies a function of two operands lane by lane.
    fn each_with(self, other: Self, f: fn(f64, f64) -> f64) -> Self;

    /// The same bits in all lanes.
    #[inline(always)]
    fn all_bits(bits: u64) -> Self {
        Self::all(f64::from_bits(bits))
    }

    /// The absolute value.
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.and(Self::all_bits(!(1 << 63)))
    }

    /// The negative.
    #[inline(always)]
    fn negated(self) -> Self {
        self.xor(Self::all_bits(1 << 63))
    }

    /// a in the lanes of a mask, b in the others.
    #[inline(always)]
    fn chosen(mask: Self, a: Self, b: Self) -> Self {
        b.xor(mask.and(a.xor(b)))
    }
}

impl Lanes for f64 {
    #[inline(always)]
    fn all(x: f64) -> f64 {
        x
    }

    #[inline(always)]
    fn times_plus(self, b: f64, c: f64) -> f64 {
        self.mul_add(b, c)
    }

    #[inline(always)]
    fn and(self, other: f64) -> f64 {
        f64::from_bits(self.to_bits() & other.to_bits())
    }

    #[inline(always)]
    fn or(self, other: f64) -> f64 {
        f64::from_bits(self.to_bits() | other.to_bits())
    }

    #[inline(always)]
    fn xor(self, other: f64) -> f64 {
        f64::from_bits(self.to_bits() ^ other.to_bits())
    }

    #[inline(always)]
    fn plus_bits(self, other: f64) -> f64 {
        f64::from_bits(self.to_bits().wrapping_add(other.to_bits()))
    }

    #[inline(always)]
    fn minus_bits(self, other: f64) -> f64 {
        f64::from_bits(self.to_bits().wrapping_sub(other.to_bits()))
    }

    #[inline(always)]
    fn up<const N: i32>(self) -> f64 {
        f64::from_bits(self.to_bits() << N)
    }

    #[inline(always)]
    fn down<const N: i32>(self) -> f64 {
        f64::from_bits(self.to_bits() >> N)
    }

    #[inline(always)]
    fn below(self, other: f64) -> f64 {
        f64::from_bits(if self < other { u64::MAX } else { 0 })
    }

    #[inline(always)]
    fn everywhere(self) -> bool {
        self.to_bits() != 0
    }

    #[inline(always)]
    fn entries<const W: usize, const N: usize>(table: &[[f64; W]; N], index: f64) -> [f64; W] {
        table[index.to_bits() as usize % N]
    }

    #[inline(always)]
    fn each(self, f: fn(f64) -> f64) -> f64 {
        f(self)
    }

    #[inline(always)]
    fn each_with(self, other: f64, f: fn(f64, f64) -> f64) -> f64 {
        f(self, other)
    }
}
