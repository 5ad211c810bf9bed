//! Numbers in lanes, for any vector width.
//!
//! Everything here is inlined into functions that are compiled for one kind of processor: there a loop over the lanes
//! becomes an instruction or two. No operation is fused or reordered, so that results are the same bits with any number
//! of lanes.

use glam::Vec4;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// N numbers, one a lane.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct Lanes<const N: usize>([f32; N]);

/// N conditions, one a lane: all bits are set, or none.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct Mask<const N: usize>([u32; N]);

macro_rules! operator {
    ($operator:ident, $method:ident, $assign:tt, $type:ident) => {
        impl<const N: usize> $operator for $type<N> {
            type Output = Self;

            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for i in 0..N {
                    self.0[i] $assign other.0[i];
                }
                self
            }
        }
    };
}

operator!(Add, add, +=, Lanes);
operator!(Sub, sub, -=, Lanes);
operator!(Mul, mul, *=, Lanes);
operator!(Div, div, /=, Lanes);
operator!(BitAnd, bitand, &=, Mask);
operator!(BitOr, bitor, |=, Mask);

impl From<Vec4> for Lanes<4> {
    #[inline(always)]
    fn from(four: Vec4) -> Self {
        Self(four.to_array())
    }
}

impl<const N: usize> Lanes<N> {
    #[inline(always)]
    pub(super) fn splat(value: f32) -> Self {
        Self([value; N])
    }

    #[inline(always)]
    pub(super) fn of(values: [f32; N]) -> Self {
        Self(values)
    }

    #[inline(always)]
    pub(super) fn to_array(self) -> [f32; N] {
        self.0
    }

    #[inline(always)]
    pub(super) fn abs(mut self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].abs();
        }
        self
    }

    /// The lesser of two numbers; the second where one is NaN, unlike `f32::min`.
    #[inline(always)]
    pub(super) fn min(mut self, other: Self) -> Self {
        for i in 0..N {
            self.0[i] = if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] };
        }
        self
    }

    /// The greater of two numbers; the second where one is NaN, unlike `f32::max`.
    #[inline(always)]
    pub(super) fn max(mut self, other: Self) -> Self {
        for i in 0..N {
            self.0[i] = if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] };
        }
        self
    }

    #[inline(always)]
    fn compare(self, other: Self, holds: impl Fn(f32, f32) -> bool) -> Mask<N> {
        let mut mask = [0; N];
        for i in 0..N {
            mask[i] = if holds(self.0[i], other.0[i]) { u32::MAX } else { 0 };
        }
        Mask(mask)
    }

    #[inline(always)]
    pub(super) fn at_most(self, other: Self) -> Mask<N> {
        self.compare(other, |a, b| a <= b)
    }

    #[inline(always)]
    pub(super) fn below(self, other: Self) -> Mask<N> {
        self.compare(other, |a, b| a < b)
    }

    #[inline(always)]
    pub(super) fn differs(self, other: Self) -> Mask<N> {
        self.compare(other, |a, b| a != b)
    }
}

impl<const N: usize> Mask<N> {
    #[inline(always)]
    pub(super) fn any(self) -> bool {
        let mut all = 0;
        for i in 0..N {
            all |= self.0[i];
        }
        all != 0
    }

    /// `yes` where the condition holds, else `no`.
    #[inline(always)]
    pub(super) fn select(self, yes: Lanes<N>, no: Lanes<N>) -> Lanes<N> {
        let mut chosen = no;
        for i in 0..N {
            chosen.0[i] = f32::from_bits(self.0[i] & yes.0[i].to_bits() | !self.0[i] & no.0[i].to_bits());
        }
        chosen
    }
}
