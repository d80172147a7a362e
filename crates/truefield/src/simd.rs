//! Run-time choice of vector instructions: the same Rust body compiled several times.
//!
//! One of two files of the crate with `unsafe` (the other lends columns of an array to threads): calling functions
//! compiled for instructions that were just detected, and the comparison of vectors, which no compiler finds by
//! itself. Exact (f64) results never use fused operations, so they are the same bits at every level; only
//! single-precision filters, whose error is budgeted, may fuse.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64 as intrinsics;

/// How `a * b + c` is computed in single-precision filters, and how vectors are compared.
pub(crate) trait Fuse: Copy {
    fn mul_add(a: f32, b: f32, c: f32) -> f32;

    /// Bit i: `a[i] <= b[i]`.
    fn mask_not_above(a: &[f32; 16], b: &[f32; 16]) -> u32;

    /// Whether any `a[i] > limit`.
    fn any_above(a: &[u32; 16], limit: u32) -> bool;

    /// Puts those of `a` that are below `least` there, and `name` beside them into `names`.
    #[inline(always)]
    fn keep_least(a: &[f32; 16], name: f32, least: &mut [f32; 16], names: &mut [f32; 16]) {
        for lane in 0..16 {
            let below = a[lane] < least[lane];
            least[lane] = if below { a[lane] } else { least[lane] };
            names[lane] = if below { name } else { names[lane] };
        }
    }

    /// For both halves of `a`: whether each column of `limits` in the half is reached, `a[start + i] <= limits[i][column]` for
    /// some `i`.
    #[inline(always)]
    fn each_reached(a: &[f32; 16], limits: &[[f32; 16]; 8]) -> (bool, bool) {
        let mut beyond = [true; 16];
        for (i, limits) in limits.iter().enumerate() {
            for lane in 0..16 {
                beyond[lane] &= a[lane / 8 * 8 + i] > limits[lane];
            }
        }
        (!beyond[..8].contains(&true), !beyond[8..].contains(&true))
    }

    /// Whether any `a[i] < 0`, of numbers that are neither -0 nor none.
    fn any_negative(a: &[f32; 8]) -> bool;
}

/// Two roundings: any machine.
#[derive(Clone, Copy)]
pub(crate) struct Plain;

impl Fuse for Plain {
    #[inline(always)]
    fn mul_add(a: f32, b: f32, c: f32) -> f32 {
        a * b + c
    }

    #[inline(always)]
    fn mask_not_above(a: &[f32; 16], b: &[f32; 16]) -> u32 {
        let mut mask = 0;
        for lane in 0..16 {
            mask |= u32::from(a[lane] <= b[lane]) << lane;
        }
        mask
    }

    #[inline(always)]
    fn any_above(a: &[u32; 16], limit: u32) -> bool {
        a.iter().fold(false, |any, &a| any | (a > limit))
    }

    #[inline(always)]
    fn any_negative(a: &[f32; 8]) -> bool {
        a.iter().fold(false, |any, &a| any | (a < 0.0))
    }
}

/// One rounding, eight lanes: only instantiated by `multiversion!` where AVX2 and FMA were detected.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub(crate) struct Avx2;

#[cfg(target_arch = "x86_64")]
impl Fuse for Avx2 {
    #[inline(always)]
    fn mul_add(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
    }

    #[inline(always)]
    #[allow(unsafe_code)]
    fn mask_not_above(a: &[f32; 16], b: &[f32; 16]) -> u32 {
        // SAFETY: AVX2 was detected; both halves of both arrays are eight floats, and loads need no alignment.
        unsafe {
            let half = |start: usize| {
                let (a, b) = (intrinsics::_mm256_loadu_ps(a[start..].as_ptr()), intrinsics::_mm256_loadu_ps(b[start..].as_ptr()));
                intrinsics::_mm256_movemask_ps(intrinsics::_mm256_cmp_ps::<{ intrinsics::_CMP_LE_OQ }>(a, b)) as u32
            };
            half(0) | half(8) << 8
        }
    }

    #[inline(always)]
    #[allow(unsafe_code)]
    fn each_reached(a: &[f32; 16], limits: &[[f32; 16]; 8]) -> (bool, bool) {
        // SAFETY: AVX2 was detected; both halves of all arrays are eight floats, and loads need no alignment.
        unsafe {
            let half = |start: usize| {
                let a = intrinsics::_mm256_loadu_ps(a[start..].as_ptr());
                let mut beyond = intrinsics::_mm256_castsi256_ps(intrinsics::_mm256_set1_epi32(-1));
                for (i, limits) in limits.iter().enumerate() {
                    let one = intrinsics::_mm256_permutevar8x32_ps(a, intrinsics::_mm256_set1_epi32(i as i32));
                    let limits = intrinsics::_mm256_loadu_ps(limits[start..].as_ptr());
                    beyond = intrinsics::_mm256_and_ps(beyond, intrinsics::_mm256_cmp_ps::<{ intrinsics::_CMP_GT_OQ }>(one, limits));
                }
                intrinsics::_mm256_movemask_ps(beyond) == 0
            };
            (half(0), half(8))
        }
    }

    #[inline(always)]
    #[allow(unsafe_code)]
    fn any_above(a: &[u32; 16], limit: u32) -> bool {
        // SAFETY: AVX2 was detected; both halves of the array are eight words, and loads need no alignment.
        unsafe {
            let (low, high) = (intrinsics::_mm256_loadu_si256(a.as_ptr().cast()), intrinsics::_mm256_loadu_si256(a[8..].as_ptr().cast()));
            let limit = intrinsics::_mm256_set1_epi32(limit as i32);
            // There is no unsigned comparison: nothing is above the limit if the maximum is the limit.
            let same = intrinsics::_mm256_cmpeq_epi32(intrinsics::_mm256_max_epu32(intrinsics::_mm256_max_epu32(low, high), limit), limit);
            intrinsics::_mm256_movemask_epi8(same) != -1
        }
    }

    #[inline(always)]
    #[allow(unsafe_code)]
    fn any_negative(a: &[f32; 8]) -> bool {
        // SAFETY: AVX2 was detected; the array is eight floats, and loads need no alignment.
        unsafe { intrinsics::_mm256_movemask_ps(intrinsics::_mm256_loadu_ps(a.as_ptr())) != 0 }
    }
}

/// One rounding, sixteen lanes: only instantiated by `multiversion!` where AVX-512 was detected.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub(crate) struct Avx512;

#[cfg(target_arch = "x86_64")]
impl Fuse for Avx512 {
    #[inline(always)]
    fn mul_add(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
    }

    #[inline(always)]
    #[allow(unsafe_code)]
    fn mask_not_above(a: &[f32; 16], b: &[f32; 16]) -> u32 {
        // SAFETY: AVX-512 was detected; both arrays are sixteen floats, and loads need no alignment.
        unsafe {
            let (a, b) = (intrinsics::_mm512_loadu_ps(a.as_ptr()), intrinsics::_mm512_loadu_ps(b.as_ptr()));
            u32::from(intrinsics::_mm512_cmp_ps_mask::<{ intrinsics::_CMP_LE_OQ }>(a, b))
        }
    }

    #[inline(always)]
    #[allow(unsafe_code)]
    fn any_above(a: &[u32; 16], limit: u32) -> bool {
        // SAFETY: AVX-512 was detected; the array is sixteen words, and loads need no alignment.
        unsafe {
            intrinsics::_mm512_cmpgt_epu32_mask(
                intrinsics::_mm512_loadu_si512(a.as_ptr().cast()),
                intrinsics::_mm512_set1_epi32(limit as i32),
            ) != 0
        }
    }

    #[inline(always)]
    #[allow(unsafe_code)]
    fn keep_least(a: &[f32; 16], name: f32, least: &mut [f32; 16], names: &mut [f32; 16]) {
        // SAFETY: AVX-512 was detected; all arrays are sixteen floats, and neither loads nor stores need alignment.
        unsafe {
            let (new, old) = (intrinsics::_mm512_loadu_ps(a.as_ptr()), intrinsics::_mm512_loadu_ps(least.as_ptr()));
            let below = intrinsics::_mm512_cmp_ps_mask::<{ intrinsics::_CMP_LT_OQ }>(new, old);
            intrinsics::_mm512_storeu_ps(least.as_mut_ptr(), intrinsics::_mm512_mask_mov_ps(old, below, new));
            let (old, name) = (intrinsics::_mm512_loadu_ps(names.as_ptr()), intrinsics::_mm512_set1_ps(name));
            intrinsics::_mm512_storeu_ps(names.as_mut_ptr(), intrinsics::_mm512_mask_mov_ps(old, below, name));
        }
    }

    #[inline(always)]
    #[allow(unsafe_code)]
    fn each_reached(a: &[f32; 16], limits: &[[f32; 16]; 8]) -> (bool, bool) {
        let mut beyond = 0xffff;
        // SAFETY: AVX-512 was detected; all arrays are sixteen floats, and loads need no alignment.
        unsafe {
            let a = intrinsics::_mm512_loadu_ps(a.as_ptr());
            let start = intrinsics::_mm512_setr_epi32(0, 0, 0, 0, 0, 0, 0, 0, 8, 8, 8, 8, 8, 8, 8, 8);
            for (i, limits) in limits.iter().enumerate() {
                let one =
                    intrinsics::_mm512_permutexvar_ps(intrinsics::_mm512_add_epi32(start, intrinsics::_mm512_set1_epi32(i as i32)), a);
                let limits = intrinsics::_mm512_loadu_ps(limits.as_ptr());
                beyond = intrinsics::_mm512_mask_cmp_ps_mask::<{ intrinsics::_CMP_GT_OQ }>(beyond, one, limits);
            }
        }
        (beyond & 0xff == 0, beyond & 0xff00 == 0)
    }

    #[inline(always)]
    #[allow(unsafe_code)]
    fn any_negative(a: &[f32; 8]) -> bool {
        // SAFETY: AVX-512 was detected; the array is eight floats, and loads need no alignment.
        unsafe { intrinsics::_mm256_movemask_ps(intrinsics::_mm256_loadu_ps(a.as_ptr())) != 0 }
    }
}

/// `multiversion!(pub(crate) fn name(x: X) -> Y = body);` compiles `body::<F>` for each level.
///
/// `body` must be `#[inline(always)]` and take the same arguments.
macro_rules! multiversion {
    ($(#[$meta:meta])* $visibility:vis fn $name:ident($($argument:ident: $kind:ty),* $(,)?) $(-> $result:ty)? = $body:ident) => {
        $(#[$meta])*
        #[inline]
        #[allow(unsafe_code, clippy::too_many_arguments)]
        $visibility fn $name($($argument: $kind),*) $(-> $result)? {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
                fn wide($($argument: $kind),*) $(-> $result)? {
                    $body::<$crate::simd::Avx512>($($argument),*)
                }
                #[target_feature(enable = "avx2,fma")]
                fn middle($($argument: $kind),*) $(-> $result)? {
                    $body::<$crate::simd::Avx2>($($argument),*)
                }
                if std::arch::is_x86_feature_detected!("avx512f")
                    && std::arch::is_x86_feature_detected!("avx512vl")
                    && std::arch::is_x86_feature_detected!("avx512dq")
                    && std::arch::is_x86_feature_detected!("avx512bw")
                    && std::arch::is_x86_feature_detected!("fma")
                {
                    // SAFETY: the features were detected on this processor.
                    return unsafe { wide($($argument),*) };
                }
                if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
                    // SAFETY: the features were detected on this processor.
                    return unsafe { middle($($argument),*) };
                }
            }
            $body::<$crate::simd::Plain>($($argument),*)
        }
    };
}
pub(crate) use multiversion;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::Random;

    type Vector = [f32; 16];

    /// What all levels have to agree on.
    #[derive(Debug, PartialEq)]
    struct Found {
        least: Vector,
        names: Vector,
        reached: (bool, bool),
        mask: u32,
        above: bool,
    }

    #[inline(always)]
    fn found_body<F: Fuse>(a: &Vector, b: &Vector, limits: &[Vector; 8]) -> Found {
        let (mut least, mut names) = (*b, [1.0; 16]);
        F::keep_least(a, 7.0, &mut least, &mut names);
        let words = a.map(|x| (8.0 * x) as u32);
        Found { least, names, reached: F::each_reached(a, limits), mask: F::mask_not_above(a, b), above: F::any_above(&words, 7) }
    }

    multiversion!(fn found(a: &Vector, b: &Vector, limits: &[Vector; 8]) -> Found = found_body);

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn found_by_eights(a: &Vector, b: &Vector, limits: &[Vector; 8]) -> Found {
        found_body::<Avx2>(a, b, limits)
    }

    #[test]
    #[allow(unsafe_code)]
    fn every_level_compares_alike() {
        let mut random = Random::new(17);
        let mut reached = [0; 2];
        for _ in 0..20_000 {
            // Few different numbers, so that many are equal.
            let mut vector = |most: f64| -> Vector { std::array::from_fn(|_| (random.between(0.0, most) * 8.0).round() as f32 / 8.0) };
            let (a, b, limits) = (vector(1.0), vector(1.0), std::array::from_fn(|_| vector(0.4)));
            let plain = found_body::<Plain>(&a, &b, &limits);
            let column = |lane: usize| (0..8).any(|i| a[lane / 8 * 8 + i] <= limits[i][lane]);
            assert_eq!(plain.reached, ((0..8).all(column), (8..16).all(column)), "{a:?} {limits:?}");
            for lane in 0..16 {
                let name = if a[lane] < b[lane] { 7.0 } else { 1.0 };
                assert_eq!((plain.least[lane], plain.names[lane]), (a[lane].min(b[lane]), name));
                assert_eq!(plain.mask >> lane & 1 == 1, a[lane] <= b[lane]);
            }
            assert_eq!(plain.above, a.iter().any(|&x| x >= 1.0));
            assert_eq!(found(&a, &b, &limits), plain);
            #[cfg(target_arch = "x86_64")]
            if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
                // SAFETY: the features were detected on this processor.
                assert_eq!(unsafe { found_by_eights(&a, &b, &limits) }, plain);
            }
            reached[0] += usize::from(plain.reached.0);
            reached[1] += usize::from(plain.reached.1);
        }
        assert!(reached.iter().all(|n| (1_000..19_000).contains(n)), "{reached:?}");
    }
}
