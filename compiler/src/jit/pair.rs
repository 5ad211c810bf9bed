//! Pairs of doubles for the elementary functions of native code.

use crate::ir::elementary::Lanes;
use std::ops::{Add, Mul, Sub};

/// Two doubles as generated code has them in memory.
pub(super) type Two = [f64; 2];

/// A pair that is computed with wherever there are no instructions for pairs.
#[derive(Clone, Copy)]
pub(super) struct Pair(Two);

impl Pair {
    #[inline(always)]
    pub(super) fn load(place: &Two) -> Pair {
        Pair(*place)
    }

    #[inline(always)]
    pub(super) fn store(self, place: &mut Two) {
        *place = self.0;
    }

    #[inline(always)]
    fn with(self, other: Pair, f: impl Fn(f64, f64) -> f64) -> Pair {
        Pair([f(self.0[0], other.0[0]), f(self.0[1], other.0[1])])
    }
}

impl Add for Pair {
    type Output = Pair;

    #[inline(always)]
    fn add(self, other: Pair) -> Pair {
        self.with(other, |a, b| a + b)
    }
}

impl Sub for Pair {
    type Output = Pair;

    #[inline(always)]
    fn sub(self, other: Pair) -> Pair {
        self.with(other, |a, b| a - b)
    }
}

impl Mul for Pair {
    type Output = Pair;

    #[inline(always)]
    fn mul(self, other: Pair) -> Pair {
        self.with(other, |a, b| a * b)
    }
}

impl Lanes for Pair {
    #[inline(always)]
    fn all(x: f64) -> Pair {
        Pair([x; 2])
    }

    #[inline(always)]
    fn times_plus(self, b: Pair, c: Pair) -> Pair {
        Pair([self.0[0].mul_add(b.0[0], c.0[0]), self.0[1].mul_add(b.0[1], c.0[1])])
    }

    #[inline(always)]
    fn and(self, other: Pair) -> Pair {
        self.with(other, Lanes::and)
    }

    #[inline(always)]
    fn or(self, other: Pair) -> Pair {
        self.with(other, Lanes::or)
    }

    #[inline(always)]
    fn xor(self, other: Pair) -> Pair {
        self.with(other, Lanes::xor)
    }

    #[inline(always)]
    fn plus_bits(self, other: Pair) -> Pair {
        self.with(other, Lanes::plus_bits)
    }

    #[inline(always)]
    fn minus_bits(self, other: Pair) -> Pair {
        self.with(other, Lanes::minus_bits)
    }

    #[inline(always)]
    fn up<const N: i32>(self) -> Pair {
        Pair(self.0.map(Lanes::up::<N>))
    }

    #[inline(always)]
    fn down<const N: i32>(self) -> Pair {
        Pair(self.0.map(Lanes::down::<N>))
    }

    #[inline(always)]
    fn below(self, other: Pair) -> Pair {
        self.with(other, Lanes::below)
    }

    #[inline(always)]
    fn everywhere(self) -> bool {
        self.0[0].everywhere() && self.0[1].everywhere()
    }

    #[inline(always)]
    fn entries<const W: usize, const N: usize>(table: &[[f64; W]; N], index: Pair) -> [Pair; W] {
        let [a, b] = index.0.map(|i| f64::entries(table, i));
        std::array::from_fn(|k| Pair([a[k], b[k]]))
    }

    #[inline(always)]
    fn each(self, f: fn(f64) -> f64) -> Pair {
        Pair(self.0.map(f))
    }

    #[inline(always)]
    fn each_with(self, other: Pair, f: fn(f64, f64) -> f64) -> Pair {
        self.with(other, f)
    }
}

/// A pair in a register of a machine that multiplies and adds at once.
#[cfg(target_arch = "x86_64")]
pub(super) mod fused {
    use super::{Add, Lanes, Mul, Sub, Two};
    use std::arch::x86_64::{
        __m128d, __m128i, _mm_add_epi64, _mm_add_pd, _mm_and_pd, _mm_castpd_si128, _mm_castsi128_pd, _mm_cmplt_pd,
        _mm_cvtsd_f64, _mm_fmadd_pd, _mm_movemask_pd, _mm_mul_pd, _mm_or_pd, _mm_set_pd, _mm_set1_pd, _mm_slli_epi64,
        _mm_srli_epi64, _mm_sub_epi64, _mm_sub_pd, _mm_unpackhi_pd, _mm_xor_pd,
    };

    /// An instruction of the machine.
    macro_rules! instruction {
        ($instruction:expr) => {
            // SAFETY: SSE2 is on every x86-64. The one instruction that is not of it takes pairs, which there are only
            // where `Fused::load` was called, on a machine that has it.
            unsafe { $instruction }
        };
    }

    /// Made only by [`Fused::load`], which asks for what the machine must have, and from others.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Fused(__m128d);

    impl Fused {
        /// # Safety
        /// The machine must have fused multiplications and additions (`fma`).
        #[inline(always)]
        pub(in super::super) unsafe fn load(place: &Two) -> Fused {
            Fused(instruction!(_mm_set_pd(place[1], place[0])))
        }

        #[inline(always)]
        pub(in super::super) fn store(self, place: &mut Two) {
            *place = self.lanes();
        }

        #[inline(always)]
        fn lanes(self) -> Two {
            instruction!([_mm_cvtsd_f64(self.0), _mm_cvtsd_f64(_mm_unpackhi_pd(self.0, self.0))])
        }

        #[inline(always)]
        fn integers(self) -> __m128i {
            instruction!(_mm_castpd_si128(self.0))
        }

        #[inline(always)]
        fn of_integers(integers: __m128i) -> Fused {
            Fused(instruction!(_mm_castsi128_pd(integers)))
        }
    }

    impl Add for Fused {
        type Output = Fused;

        #[inline(always)]
        fn add(self, other: Fused) -> Fused {
            Fused(instruction!(_mm_add_pd(self.0, other.0)))
        }
    }

    impl Sub for Fused {
        type Output = Fused;

        #[inline(always)]
        fn sub(self, other: Fused) -> Fused {
            Fused(instruction!(_mm_sub_pd(self.0, other.0)))
        }
    }

    impl Mul for Fused {
        type Output = Fused;

        #[inline(always)]
        fn mul(self, other: Fused) -> Fused {
            Fused(instruction!(_mm_mul_pd(self.0, other.0)))
        }
    }

    impl Lanes for Fused {
        #[inline(always)]
        fn all(x: f64) -> Fused {
            Fused(instruction!(_mm_set1_pd(x)))
        }

        #[inline(always)]
        fn times_plus(self, b: Fused, c: Fused) -> Fused {
            Fused(instruction!(_mm_fmadd_pd(self.0, b.0, c.0)))
        }

        #[inline(always)]
        fn and(self, other: Fused) -> Fused {
            Fused(instruction!(_mm_and_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn or(self, other: Fused) -> Fused {
            Fused(instruction!(_mm_or_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn xor(self, other: Fused) -> Fused {
            Fused(instruction!(_mm_xor_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn plus_bits(self, other: Fused) -> Fused {
            Fused::of_integers(instruction!(_mm_add_epi64(self.integers(), other.integers())))
        }

        #[inline(always)]
        fn minus_bits(self, other: Fused) -> Fused {
            Fused::of_integers(instruction!(_mm_sub_epi64(self.integers(), other.integers())))
        }

        #[inline(always)]
        fn up<const N: i32>(self) -> Fused {
            Fused::of_integers(instruction!(_mm_slli_epi64::<N>(self.integers())))
        }

        #[inline(always)]
        fn down<const N: i32>(self) -> Fused {
            Fused::of_integers(instruction!(_mm_srli_epi64::<N>(self.integers())))
        }

        #[inline(always)]
        fn below(self, other: Fused) -> Fused {
            Fused(instruction!(_mm_cmplt_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn everywhere(self) -> bool {
            instruction!(_mm_movemask_pd(self.0)) == 3
        }

        #[inline(always)]
        fn entries<const W: usize, const N: usize>(table: &[[f64; W]; N], index: Fused) -> [Fused; W] {
            let [a, b] = index.lanes().map(|i| &table[i.to_bits() as usize % N]);
            std::array::from_fn(|k| Fused(instruction!(_mm_set_pd(b[k], a[k]))))
        }

        #[inline(always)]
        fn each(self, f: fn(f64) -> f64) -> Fused {
            let [a, b] = self.lanes().map(f);
            Fused(instruction!(_mm_set_pd(b, a)))
        }

        #[inline(always)]
        fn each_with(self, other: Fused, f: fn(f64, f64) -> f64) -> Fused {
            let ([a, b], [c, d]) = (self.lanes(), other.lanes());
            Fused(instruction!(_mm_set_pd(f(b, d), f(a, c))))
        }
    }
}
