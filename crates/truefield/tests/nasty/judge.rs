//! Independent judges in exact integers: the distance to a triangle by regions instead of candidates,
//! and the winding number of a watertight mesh by crossings instead of angles.

use num_bigint::{BigInt, Sign};
use truefield::laws::Random;
use truefield::{DVec3, TriangleMesh};

type Exact = [BigInt; 3];

/// The distance from `p` to the triangle, right to the last bits of a double.
///
/// All coordinates become integers over one power of two, so every sign below is exact. The Voronoi
/// region of `p` decides what is nearest (Ericson, Real-Time Collision Detection, 5.1.5), and the
/// squared distance is a ratio of two integers: |w|^2, |w x ab|^2 / |ab|^2 or (w . n)^2 / |n|^2.
pub fn distance([a, b, c]: [DVec3; 3], p: DVec3) -> f64 {
    let ([a, b, c, p], unit) = integers([a, b, c, p]);
    let (ab, ac, ap) = (minus(&b, &a), minus(&c, &a), minus(&p, &a));
    let (bp, cp, bc) = (minus(&p, &b), minus(&p, &c), minus(&c, &b));
    let n = cross(&ab, &ac);
    let root = |numerator: BigInt, denominator: BigInt| ratio_root(&numerator, &denominator, unit);
    let to_edge = |e: &Exact, from_start: &Exact, from_end: &Exact| {
        if dot(e, from_start) <= BigInt::ZERO {
            root(dot(from_start, from_start), BigInt::from(1))
        } else if dot(e, from_end) >= BigInt::ZERO {
            root(dot(from_end, from_end), BigInt::from(1))
        } else {
            let across = cross(from_start, e);
            root(dot(&across, &across), dot(e, e))
        }
    };
    if n.iter().all(|x| x.sign() == Sign::NoSign) {
        return to_edge(&ab, &ap, &bp).min(to_edge(&bc, &bp, &cp)).min(to_edge(&ac, &ap, &cp));
    }
    let positive = |x: &BigInt| x.sign() == Sign::Plus;
    let (d1, d2) = (dot(&ab, &ap), dot(&ac, &ap));
    if !positive(&d1) && !positive(&d2) {
        return root(dot(&ap, &ap), BigInt::from(1));
    }
    let (d3, d4) = (dot(&ab, &bp), dot(&ac, &bp));
    if d3 >= BigInt::ZERO && d4 <= d3 {
        return root(dot(&bp, &bp), BigInt::from(1));
    }
    let edge = |e: &Exact, from: &Exact| {
        let across = cross(from, e);
        root(dot(&across, &across), dot(e, e))
    };
    if &d1 * &d4 <= &d3 * &d2 && positive(&d1) && d3 <= BigInt::ZERO {
        return edge(&ab, &ap);
    }
    let (d5, d6) = (dot(&ab, &cp), dot(&ac, &cp));
    if d6 >= BigInt::ZERO && d5 <= d6 {
        return root(dot(&cp, &cp), BigInt::from(1));
    }
    if &d5 * &d2 <= &d1 * &d6 && positive(&d2) && d6 <= BigInt::ZERO {
        return edge(&ac, &ap);
    }
    if &d3 * &d6 <= &d5 * &d4 && d4 >= d3 && d5 >= d6 {
        return edge(&bc, &bp);
    }
    let height = dot(&ap, &n);
    root(&height * &height, dot(&n, &n))
}

/// How often a watertight mesh winds around `p`; `None` if `p` lies on it.
///
/// Counts the oriented crossings of the way from `p` to a far point, every one decided by the exact
/// signs of volumes; a way that touches an edge is given up for another.
pub fn winding(mesh: &TriangleMesh, p: DVec3) -> Option<i32> {
    let mut random = Random::new(1);
    let extent = mesh.extent();
    let reach = extent.diagonal() + (p - extent.center()).length();
    'ways: for _ in 0..16 {
        let far = p + random.direction() * (3.0 * reach);
        let mut winding = 0;
        for triangle in 0..mesh.triangles().len() as u32 {
            let [a, b, c] = mesh.corners(triangle);
            let (below, above) = (side([a, b, c], p), side([a, b, c], far));
            if below == 0 || above == 0 {
                // In line with the triangle's plane: it matters only if the way could touch it.
                let corners = [side([p, far, a], b), side([p, far, b], c), side([p, far, c], a)];
                if corners.iter().all(|&s| s >= 0) || corners.iter().all(|&s| s <= 0) {
                    continue 'ways;
                }
                continue;
            }
            if below == above {
                continue;
            }
            let edges = [side([p, far, a], b), side([p, far, b], c), side([p, far, c], a)];
            if edges.iter().all(|&s| s > 0) || edges.iter().all(|&s| s < 0) {
                // From inside out, against the normal's back: below the plane first.
                winding -= below;
            } else if !(edges.contains(&1) && edges.contains(&-1)) {
                continue 'ways;
            }
        }
        return Some(winding);
    }
    None
}

/// The exact sign of the volume of the tetrahedron `a b c d`: 1 if `d` lies above the triangle.
fn side([a, b, c]: [DVec3; 3], d: DVec3) -> i32 {
    let (u, v, w) = (b - a, c - a, d - a);
    let volume = u.cross(v).dot(w);
    // Rounding of differences, products and sums, generously.
    let error = 1e-14 * u.abs().element_sum() * v.abs().element_sum() * w.abs().element_sum();
    if volume.abs() > error && error > 1e-280 {
        return if volume > 0.0 { 1 } else { -1 };
    }
    let ([a, b, c, d], _) = integers([a, b, c, d]);
    match dot(&cross(&minus(&b, &a), &minus(&c, &a)), &minus(&d, &a)).sign() {
        Sign::Minus => -1,
        Sign::NoSign => 0,
        Sign::Plus => 1,
    }
}

/// Points as integers over one power of two.
fn integers<const N: usize>(points: [DVec3; N]) -> ([Exact; N], i32) {
    let numbers = points.map(|v| v.to_array().map(split));
    let unit = numbers.iter().flatten().filter(|(m, _)| *m != 0).map(|&(_, e)| e).min().unwrap_or(0);
    (numbers.map(|v| v.map(|(m, e)| if m == 0 { BigInt::ZERO } else { BigInt::from(m) << (e - unit) as u64 })), unit)
}

/// `x = m * 2^e` with an integer `m`.
fn split(x: f64) -> (i64, i32) {
    let bits = x.to_bits();
    let exponent = (bits >> 52 & 0x7ff) as i32;
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let (m, e) = if exponent == 0 { (fraction, -1074) } else { (fraction | 1 << 52, exponent - 1075) };
    (if x.is_sign_negative() { -m } else { m }, e)
}

fn minus(a: &Exact, b: &Exact) -> Exact {
    std::array::from_fn(|i| &a[i] - &b[i])
}

fn dot(a: &Exact, b: &Exact) -> BigInt {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}

fn cross(a: &Exact, b: &Exact) -> Exact {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        &a[j] * &b[k] - &a[k] * &b[j]
    })
}

/// sqrt(numerator / denominator) * 2^unit.
fn ratio_root(numerator: &BigInt, denominator: &BigInt, unit: i32) -> f64 {
    if numerator.sign() == Sign::NoSign {
        return 0.0;
    }
    // A quotient of 120 bits or so, at an even power of two.
    let shift = (120 - numerator.bits() as i64 + denominator.bits() as i64) & !1;
    let quotient = if shift >= 0 { (numerator << shift) / denominator } else { numerator / (denominator << -shift) };
    let quotient = u128::try_from(quotient).expect("a quotient of 120 bits") as f64;
    let power = i64::from(unit) - shift / 2;
    // In two steps, so that a factor beyond the doubles still gives a product within them.
    quotient.sqrt() * 2f64.powi((power / 2) as i32) * 2f64.powi((power - power / 2) as i32)
}
