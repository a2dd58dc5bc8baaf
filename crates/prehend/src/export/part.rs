//! A part of a solid, cut by planes.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix2, Matrix3, Point3, Vector2, Vector3};
use prehend_geometry::{ConvexHull, Surface, TriMesh, convex_hull};

/// A corner closer to a plane than this share of the object's size lies in it.
const IN_PLANE: f64 = 1e-9;

/// A plane: points p with normal · p = offset. What is kept of a cut lies at or below it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    pub(super) normal: Vector3<f64>,
    pub(super) offset: f64,
}

impl Plane {
    fn height(&self, p: &Point3<f64>) -> f64 {
        self.normal.dot(&p.coords) - self.offset
    }

    pub(super) fn flipped(&self) -> Self {
        Self {
            normal: -self.normal,
            offset: -self.offset,
        }
    }
}

/// A part of a solid: what cuts have left of its surface, and of its inside.
#[derive(Debug, Clone)]
pub(super) struct Part {
    points: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// The cuts that made it.
    planes: Vec<Plane>,
    /// Where three of them meet inside the solid: corners of the part that are not on the surface.
    inner: Vec<Point3<f64>>,
    /// Volume of its hull, m³: more than 0.
    pub(super) hull_volume: f64,
}

impl Part {
    pub(super) fn of(mesh: &TriMesh) -> Option<Self> {
        let (points, triangles) = (mesh.vertices().to_vec(), mesh.triangles().to_vec());
        Self::new(points, triangles, Vec::new(), Vec::new())
    }

    /// `None` where the hull would be flat.
    fn new(
        points: Vec<Point3<f64>>,
        triangles: Vec<[u32; 3]>,
        planes: Vec<Plane>,
        inner: Vec<Point3<f64>>,
    ) -> Option<Self> {
        let mut part = Self {
            points,
            triangles,
            planes,
            inner,
            hull_volume: 0.0,
        };
        part.hull_volume = part.hull()?.volume();
        (part.hull_volume > 0.0).then_some(part)
    }

    /// The hull of what the part holds: its surface, and corners inside the solid.
    pub(super) fn hull(&self) -> Option<ConvexHull> {
        if self.inner.is_empty() {
            return convex_hull(&self.points).ok();
        }
        convex_hull(&[&self.points[..], &self.inner].concat()).ok()
    }

    /// What lies below a plane. Faces in the plane belong to the side on which the solid is.
    pub(super) fn below(&self, plane: &Plane, solid: &Surface) -> Option<Self> {
        self.below_all(&[*plane], solid)
    }

    /// What lies below all these planes.
    fn below_all(&self, cuts: &[Plane], solid: &Surface) -> Option<Self> {
        let (mut points, mut triangles) = (Vec::new(), Vec::new());
        let (mut planes, mut inner) = (self.planes.clone(), self.inner.clone());
        for (k, cut) in cuts.iter().enumerate() {
            (points, triangles) = if k == 0 {
                clip(&self.points, &self.triangles, cut)
            } else {
                clip(&points, &triangles, cut)
            };
            inner.retain(|p| cut.height(p) <= 0.0);
            inner.extend(corners_inside(&planes, cut, solid));
            planes.push(*cut);
        }
        Self::new(points, triangles, planes, inner)
    }

    /// Lowest and highest place along a direction.
    pub(super) fn extent(&self, direction: &Vector3<f64>) -> (f64, f64) {
        self.points
            .iter()
            .chain(&self.inner)
            .map(|p| p.coords.dot(direction))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
                (l.min(x), h.max(x))
            })
    }

    /// Places along a direction where most of the area of faces square to it lies, at most `n`, as (place, share).
    pub(super) fn levels(&self, direction: &Vector3<f64>, n: usize) -> Vec<f64> {
        let (low, high) = self.extent(direction);
        let width = (high - low) / 100.0;
        // Bins overlap by half, so that a face on the border of one lies well inside another.
        let mut bins: BTreeMap<i64, (f64, f64)> = BTreeMap::new();
        for [a, b, c] in self.corners() {
            let cross = (b - a).cross(&(c - a)) * 0.5;
            let area = cross.norm();
            if area > 0.0 && cross.dot(direction).abs() > 0.98 * area {
                let place = (a.coords + b.coords + c.coords).dot(direction) / 3.0;
                let bin = bins.entry(((place - low) / width).floor() as i64).or_default();
                bin.0 += area;
                bin.1 += area * place;
            }
        }
        let mut found: Vec<(f64, f64)> = bins.values().map(|(area, sum)| (*area, sum / area)).collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)));
        found.truncate(n);
        found.into_iter().map(|(_, place)| place).collect()
    }

    /// Unit directions along which the surface extends most and least, and the third.
    pub(super) fn principal_directions(&self) -> [Vector3<f64>; 3] {
        let mut sum = Matrix3::zeros();
        let (mut mean, mut total) = (Vector3::zeros(), 0.0);
        let weighted: Vec<(f64, Vector3<f64>)> = self
            .corners()
            .map(|[a, b, c]| {
                (
                    (b - a).cross(&(c - a)).norm(),
                    (a.coords + b.coords + c.coords) / 3.0,
                )
            })
            .collect();
        for (area, p) in &weighted {
            mean += p * *area;
            total += area;
        }
        mean /= f64::max(total, f64::MIN_POSITIVE);
        for (area, p) in &weighted {
            let d = p - mean;
            sum += d * d.transpose() * *area;
        }
        let eigen = nalgebra::SymmetricEigen::new(sum);
        [0, 1, 2].map(|k| eigen.eigenvectors.column(k).into_owned())
    }

    /// A point of the line along `direction` that the surface curves around: the one nearest the normals of its faces.
    fn axis_point(&self, direction: &Vector3<f64>) -> Option<Point3<f64>> {
        let [u, v] = across(direction);
        let flat = |p: Vector3<f64>| Vector2::new(p.dot(&u), p.dot(&v));
        let faces: Vec<(f64, Vector2<f64>, Vector2<f64>)> = self
            .corners()
            .filter_map(|[a, b, c]| {
                let cross = (b - a).cross(&(c - a));
                let normal = flat(cross);
                let weight = normal.norm();
                (weight > 0.0).then(|| {
                    (
                        weight,
                        normal / weight,
                        flat((a.coords + b.coords + c.coords) / 3.0),
                    )
                })
            })
            .collect();
        let (low, high) = (self.extent(&u), self.extent(&v));
        let size = (low.1 - low.0).max(high.1 - high.0);
        let mut center = Vector2::new((low.0 + low.1) / 2.0, (high.0 + high.1) / 2.0);
        // A handle's faces point elsewhere: what is far off the axis counts for less in each round.
        for round in 0..6 {
            let (mut left, mut right) = (Matrix2::zeros(), Vector2::zeros());
            for (weight, normal, p) in &faces {
                let off_normal = Matrix2::identity() - normal * normal.transpose();
                let miss = (off_normal * (center - p)).norm() / (0.05 * size);
                let weight = if round == 0 {
                    *weight
                } else {
                    weight / (1.0 + miss * miss)
                };
                left += off_normal * weight;
                right += off_normal * p * weight;
            }
            center = left.try_inverse()? * right;
        }
        let point = u * center.x + v * center.y;
        point.iter().all(|x| x.is_finite()).then(|| Point3::from(point))
    }

    /// The part in wedges about the line that it curves around along `direction`: `n` of equal angle over the angle that it
    /// takes up, the first border turned by `phase` of a wedge where that is the whole circle.
    pub(super) fn wedges(
        &self,
        direction: &Vector3<f64>,
        n: usize,
        phase: f64,
        solid: &Surface,
    ) -> Option<Vec<Self>> {
        let center = self.axis_point(direction)?;
        let [u, v] = across(direction);
        let angle = |p: &Point3<f64>| {
            let d = p - center;
            d.dot(&v).atan2(d.dot(&u))
        };
        let (start, span) = angles_taken(self.points.iter().chain(&self.inner).map(angle));
        // Only where its points take up less than half of the circle is nothing of it elsewhere.
        let whole = span >= PI;
        let (start, span) = if whole {
            (phase * TAU / n as f64, TAU)
        } else {
            (start, span)
        };
        if !whole && phase != 0.0 {
            return None;
        }
        let width = span / n as f64;
        let border = |k: usize| {
            let (sin, cos) = (start + width * k as f64).sin_cos();
            // Below it: less than half a turn ahead of the border.
            let normal = u * sin - v * cos;
            Plane {
                normal,
                offset: normal.dot(&center.coords),
            }
        };
        let wedges = (0..n).filter_map(|k| match (whole, k) {
            (false, 0) => self.below(&border(1).flipped(), solid),
            (false, k) if k + 1 == n => self.below(&border(k), solid),
            _ => self.below_all(&[border(k), border(k + 1).flipped()], solid),
        });
        Some(wedges.collect())
    }

    fn corners(&self) -> impl Iterator<Item = [Point3<f64>; 3]> + '_ {
        self.triangles.iter().map(|t| t.map(|i| self.points[i as usize]))
    }
}

/// Where a new plane meets two others below all of them and inside the solid.
fn corners_inside(planes: &[Plane], cut: &Plane, solid: &Surface) -> Vec<Point3<f64>> {
    let mut found = Vec::new();
    for (i, first) in planes.iter().enumerate() {
        for (j, second) in planes.iter().enumerate().skip(i + 1) {
            let rows = Matrix3::from_rows(&[
                first.normal.transpose(),
                second.normal.transpose(),
                cut.normal.transpose(),
            ]);
            // Planes that are nearly parallel meet nowhere near.
            if rows.determinant().abs() < 1e-6 {
                continue;
            }
            let offsets = Vector3::new(first.offset, second.offset, cut.offset);
            let Some(p) = rows.try_inverse().map(|inverse| Point3::from(inverse * offsets)) else {
                continue;
            };
            let below = |(k, plane): (usize, &Plane)| k == i || k == j || plane.height(&p) <= 0.0;
            if planes.iter().enumerate().all(below) && solid.is_inside(&p) {
                found.push(p);
            }
        }
    }
    found
}

/// Two unit vectors across a direction.
fn across(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let other = if direction.x.abs() < 0.6 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let u = direction.cross(&other).normalize();
    [u, direction.cross(&u)]
}

/// Where the angles start and how much of the circle they take up: all of it but the largest gap.
fn angles_taken(angles: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut sorted: Vec<f64> = angles.collect();
    sorted.sort_by(f64::total_cmp);
    let Some((&first, &last)) = sorted.first().zip(sorted.last()) else {
        return (0.0, TAU);
    };
    let (mut start, mut gap) = (first, first + TAU - last);
    for pair in sorted.windows(2) {
        if pair[1] - pair[0] > gap {
            (start, gap) = (pair[1], pair[1] - pair[0]);
        }
    }
    (start, TAU - gap)
}

/// The triangles' parts at or below a plane, with the points that they use.
fn clip(points: &[Point3<f64>], triangles: &[[u32; 3]], plane: &Plane) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let size = points.iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
    let above: Vec<f64> = points
        .iter()
        .map(|p| {
            let d = p.coords.dot(&plane.normal) - plane.offset;
            if d.abs() <= IN_PLANE * size { 0.0 } else { d }
        })
        .collect();
    let mut kept = Kept {
        points: Vec::new(),
        of_point: vec![u32::MAX; points.len()],
        of_edge: BTreeMap::new(),
    };
    let mut out = Vec::new();
    for t in triangles {
        let d = t.map(|i| above[i as usize]);
        if d.iter().all(|d| *d >= 0.0) {
            let [a, b, c] = t.map(|i| points[i as usize]);
            let lies_in_it = d.iter().all(|d| *d == 0.0);
            if !(lies_in_it && (b - a).cross(&(c - a)).dot(&plane.normal) > 0.0) {
                continue;
            }
        }
        let mut polygon: Vec<u32> = Vec::with_capacity(4);
        for k in 0..3 {
            let (i, j) = (t[k], t[(k + 1) % 3]);
            let (di, dj) = (d[k], d[(k + 1) % 3]);
            if di <= 0.0 {
                polygon.push(kept.point(points, i));
            }
            if di * dj < 0.0 {
                polygon.push(kept.crossing(points, [i, j], [di, dj]));
            }
        }
        for k in 2..polygon.len() {
            out.push([polygon[0], polygon[k - 1], polygon[k]]);
        }
    }
    (kept.points, out)
}

/// Points that stay, each once.
struct Kept {
    points: Vec<Point3<f64>>,
    of_point: Vec<u32>,
    of_edge: BTreeMap<[u32; 2], u32>,
}

impl Kept {
    fn point(&mut self, points: &[Point3<f64>], i: u32) -> u32 {
        let known = &mut self.of_point[i as usize];
        if *known == u32::MAX {
            *known = self.points.len() as u32;
            self.points.push(points[i as usize]);
        }
        *known
    }

    fn crossing(&mut self, points: &[Point3<f64>], edge: [u32; 2], above: [f64; 2]) -> u32 {
        let ([i, j], [di, dj]) = if edge[0] < edge[1] {
            (edge, above)
        } else {
            ([edge[1], edge[0]], [above[1], above[0]])
        };
        *self.of_edge.entry([i, j]).or_insert_with(|| {
            let (p, q) = (points[i as usize], points[j as usize]);
            self.points.push(p + (q - p) * (di / (di - dj)));
            self.points.len() as u32 - 1
        })
    }
}
