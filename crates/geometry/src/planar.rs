//! Convex hulls in the plane, and the rectangles around them.

/// Corners of the convex hull of plane points, as indices, counter-clockwise from the leftmost (lowest of those).
///
/// Points on an edge are left out, so are repeated ones. Collinear points give the two ends, equal points one index,
/// no points none. Coordinates must not be NaN.
///
/// # Source
///
/// Andrew, "Another efficient algorithm for convex hulls in two dimensions" (1979).
pub fn planar_hull(points: &[[f64; 2]]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let mut hull = Vec::new();
    planar_hull_into(points, &mut order, &mut hull);
    hull
}

/// [`planar_hull`] of the points that `order` names, into `hull`, without allocating; sorts `order`.
pub(crate) fn planar_hull_into(points: &[[f64; 2]], order: &mut Vec<u32>, hull: &mut Vec<u32>) {
    let at = |i: u32| points[i as usize];
    order.sort_unstable_by(|&i, &j| {
        let (p, q) = (at(i), at(j));
        p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(i.cmp(&j))
    });
    order.dedup_by(|i, j| at(*i) == at(*j));
    hull.clear();
    if order.len() < 3 {
        hull.extend_from_slice(order);
        return;
    }
    let mut extend = |base: usize, i: u32| {
        while hull.len() >= base + 2 && turn(at(hull[hull.len() - 2]), at(hull[hull.len() - 1]), at(i)) <= 0.0
        {
            hull.pop();
        }
        hull.push(i);
        hull.len()
    };
    let mut len = 0;
    for &i in order.iter() {
        len = extend(0, i);
    }
    let lower = len - 1;
    for &i in order.iter().rev().skip(1) {
        extend(lower, i);
    }
    hull.pop();
}

/// Twice the signed area of a triangle; positive where it turns left.
pub(crate) fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Visits the rectangle around a convex polygon that is flush with each of its edges: `visit(direction, sides)`, the
/// side along the direction first.
///
/// `polygon` runs counter-clockwise and has at least three corners; `direction` is the edge's unit vector. The
/// smallest rectangle of all is among them (Freeman and Shapira 1975). Takes time linear in the number of edges
/// (rotating calipers, Toussaint 1983).
pub(crate) fn flush_rectangles(polygon: &[[f64; 2]], mut visit: impl FnMut([f64; 2], [f64; 2])) {
    let n = polygon.len();
    let next = |i: usize| if i + 1 == n { 0 } else { i + 1 };
    let dot = |d: [f64; 2], p: [f64; 2]| d[0] * p[0] + d[1] * p[1];
    // Farthest corners ahead, aside and behind; each only ever moves on around the polygon.
    let (mut ahead, mut aside, mut behind) = (1, 1, 1);
    for i in 0..n {
        let (p, q) = (polygon[i], polygon[next(i)]);
        let length = (q[0] - p[0]).hypot(q[1] - p[1]);
        if length == 0.0 {
            continue;
        }
        let u = [(q[0] - p[0]) / length, (q[1] - p[1]) / length];
        let v = [-u[1], u[0]];
        let climb = |start: usize, d: [f64; 2]| {
            let mut at = start;
            for _ in 0..n {
                let (one, two) = (next(at), next(next(at)));
                let height = dot(d, polygon[at]);
                // Over a very short edge rounding may feign a descent; nothing does so over two.
                if dot(d, polygon[one]) < height && dot(d, polygon[two]) < height {
                    break;
                }
                at = one;
            }
            at
        };
        if i == 0 {
            ahead = climb(1, u);
            aside = climb(ahead, v);
            behind = climb(aside, [-u[0], -u[1]]);
        } else {
            ahead = climb(ahead, u);
            aside = climb(aside, v);
            behind = climb(behind, [-u[0], -u[1]]);
        }
        let width = dot(u, polygon[ahead]) - dot(u, polygon[behind]);
        let height = dot(v, polygon[aside]) - dot(v, p);
        visit(u, [width, height]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_leaves_out_points_inside_on_edges_and_repeated() {
        let points = [
            [0.0, 0.0],
            [2.0, 0.0],
            [1.0, 0.0],
            [2.0, 2.0],
            [1.0, 1.0],
            [0.0, 2.0],
            [0.0, 0.0],
        ];
        assert_eq!(planar_hull(&points), [0, 1, 3, 5]);
    }

    #[test]
    fn degenerate_plane_points_give_fewer_corners() {
        assert_eq!(planar_hull(&[]), [0; 0]);
        assert_eq!(planar_hull(&[[1.0, 1.0]; 3]), [0]);
        assert_eq!(planar_hull(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), [0, 2]);
    }

    #[test]
    fn flush_rectangles_of_a_triangle_have_twice_its_area() {
        let mut areas = Vec::new();
        flush_rectangles(&[[0.0, 0.0], [4.0, 0.0], [1.0, 3.0]], |_, [w, h]| {
            areas.push(w * h);
        });
        assert_eq!(areas.len(), 3);
        assert!(areas.iter().all(|a| (a - 12.0).abs() < 1e-12), "{areas:?}");
    }

    #[test]
    fn calipers_agree_with_measuring_every_corner() {
        let ring: Vec<[f64; 2]> = (0..17)
            .map(|k| f64::from(k) * 0.37)
            .map(|a| [3.0 * a.cos() + 0.2 * a, a.sin()])
            .collect();
        let polygon: Vec<[f64; 2]> = planar_hull(&ring).iter().map(|&i| ring[i as usize]).collect();
        flush_rectangles(&polygon, |u, [width, height]| {
            let span = |d: [f64; 2]| {
                let values = polygon.iter().map(|p| d[0] * p[0] + d[1] * p[1]);
                values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
            };
            assert!((width - span(u)).abs() < 1e-12 && (height - span([-u[1], u[0]])).abs() < 1e-12);
        });
    }
}
