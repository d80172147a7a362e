//! Run-time choice of vector instructions: the same Rust body compiled several times.
//!
//! This is the only file of the crate with `unsafe`: calling a function compiled for instructions
//! that were just detected. Exact (f64) results never use fused operations, so they are the same
//! bits at every level; only single-precision filters, whose error is budgeted, may fuse.

/// How `a * b + c` is computed in single-precision filters.
pub(crate) trait Fuse: Copy {
    fn mul_add(a: f32, b: f32, c: f32) -> f32;

    /// Bit i: `a[i] <= b[i]`.
    #[inline(always)]
    fn mask_not_above(a: &[f32; 16], b: &[f32; 16]) -> u32 {
        let mut mask = 0;
        for lane in 0..16 {
            mask |= u32::from(a[lane] <= b[lane]) << lane;
        }
        mask
    }
}

/// Two roundings: any machine.
#[derive(Clone, Copy)]
pub(crate) struct Plain;

/// One rounding: machines with fused multiply-add.
#[derive(Clone, Copy)]
pub(crate) struct Fused;

impl Fuse for Plain {
    #[inline(always)]
    fn mul_add(a: f32, b: f32, c: f32) -> f32 {
        a * b + c
    }
}

impl Fuse for Fused {
    #[inline(always)]
    fn mul_add(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
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
                    $body::<$crate::simd::Fused>($($argument),*)
                }
                #[target_feature(enable = "avx2,fma")]
                fn middle($($argument: $kind),*) $(-> $result)? {
                    $body::<$crate::simd::Fused>($($argument),*)
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
