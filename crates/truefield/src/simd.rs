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

    /// Lane i: that of `a` which `lanes[i]` names, modulo 32.
    #[inline(always)]
    fn pick(a: &[[f32; 16]; 2], lanes: &[u32; 16]) -> [f32; 16] {
        let a = a.as_flattened();
        std::array::from_fn(|i| a[(lanes[i] % 32) as usize])
    }
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
    fn pick(a: &[[f32; 16]; 2], lanes: &[u32; 16]) -> [f32; 16] {
        let mut out = [0.0; 16];
        // SAFETY: AVX-512 was detected; all arrays are sixteen words, and neither loads nor stores need alignment.
        unsafe {
            let (low, high) = (intrinsics::_mm512_loadu_ps(a[0].as_ptr()), intrinsics::_mm512_loadu_ps(a[1].as_ptr()));
            let picked = intrinsics::_mm512_permutex2var_ps(low, intrinsics::_mm512_loadu_si512(lanes.as_ptr().cast()), high);
            intrinsics::_mm512_storeu_ps(out.as_mut_ptr(), picked);
        }
        out
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
