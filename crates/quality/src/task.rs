//! The wrenches that a task puts on the object, and how much of them a grasp resists.

use nalgebra::{Point3, Unit, UnitQuaternion, UnitVector3, Vector3};

use crate::hyperplane::dot;
use crate::min_norm::nearest;
use crate::{GraspWrenchSpace, QualityError, Wrench};

/// A task's disturbances: wrenches that the world puts on the object, `[fx fy fz τx τy τz]` in the object frame, torques
/// about the wrench centre divided by the torque scale. The task needs all of them, and so their whole hull, resisted.
///
/// The named sets are this project's choices, made of a weight and a few reaction forces in proportion; nobody measured
/// them. They say in which directions a task is hard. For ellipsoids of wrenches see [`crate::WrenchMetric`].
#[derive(Debug, Clone, PartialEq)]
pub struct TaskWrenches(Vec<Wrench>);

/// How much of a task a grasp resists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaskScale {
    /// The largest s such that contacts with normal forces of at most 1 (in the space's norm) resist s × every wrench of
    /// the task; 0 where some wrench meets no resistance. To 1e-11 of the largest wrench norm over the task's.
    pub scale: f64,
    /// Index of the wrench that allows no more.
    pub limiting: usize,
}

impl TaskWrenches {
    /// A set of disturbances.
    ///
    /// # Errors
    ///
    /// [`QualityError::BadTaskWrench`] for one that is zero or not finite, [`QualityError::NoTaskWrenches`] for none.
    pub fn new(wrenches: Vec<Wrench>) -> Result<Self, QualityError> {
        if wrenches.is_empty() {
            return Err(QualityError::NoTaskWrenches);
        }
        for (wrench_idx, wrench) in wrenches.iter().enumerate() {
            let size = wrench.norm_squared();
            if !(size.is_finite() && size > 0.0) {
                return Err(QualityError::BadTaskWrench {
                    wrench_idx,
                    wrench: (*wrench).into(),
                });
            }
        }
        Ok(Self(wrenches))
    }

    /// Pouring: the weight 1, in every direction that it takes while the object tilts by 0 to 135° (steps of 15°) by the
    /// right hand about `axis`, each time with a torque of ±0.1 about `axis`, from what moves inside. `up` points up in
    /// the object frame before the tilt. 20 wrenches.
    pub fn pouring(up: &UnitVector3<f64>, axis: &UnitVector3<f64>) -> Self {
        let mut wrenches = Vec::new();
        for step in 0..10 {
            let tilt = f64::from(step) * std::f64::consts::PI / 12.0;
            // The object turns by `tilt`; seen from it, the world turns back.
            let down = UnitQuaternion::from_axis_angle(axis, -tilt) * -up.into_inner();
            for twist in [-0.1, 0.1] {
                wrenches.push(join(down, twist * axis.into_inner()));
            }
        }
        Self(wrenches)
    }

    /// Hammering: a blow's reaction of 1 at the point `head`, straight against `blow` or 15° to any of four sides, and a
    /// weight of 0.1 along each axis, either way (a hammer is swung). `blow` is the way the head flies; `head`, `center`
    /// and `torque_scale` are in the unit and frame of the contacts. 11 wrenches.
    pub fn hammering(
        head: &Point3<f64>,
        blow: &UnitVector3<f64>,
        center: &Point3<f64>,
        torque_scale: f64,
    ) -> Self {
        let arm = head - center;
        let mut wrenches: Vec<Wrench> = around(blow, 15.0_f64.to_radians(), 4)
            .into_iter()
            .map(|f| join(-f, arm.cross(&-f) / torque_scale))
            .collect();
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            wrenches.extend([0.1, -0.1].map(|weight| join(weight * axis, Vector3::zeros())));
        }
        Self(wrenches)
    }

    /// Handing over: the receiver pulls with 1, straight along `pull` or 60° to any of eight sides, while the weight 0.5
    /// still acts along −`up`, and twists by ±0.1 about `pull`. 18 wrenches.
    pub fn handing_over(up: &UnitVector3<f64>, pull: &UnitVector3<f64>) -> Self {
        let mut wrenches = Vec::new();
        for force in around(pull, 60.0_f64.to_radians(), 8) {
            for twist in [-0.1, 0.1] {
                wrenches.push(join(force - 0.5 * up.into_inner(), twist * pull.into_inner()));
            }
        }
        Self(wrenches)
    }

    /// The disturbances.
    pub fn wrenches(&self) -> &[Wrench] {
        &self.0
    }

    /// How much of the task the grasp resists: the ε of this task's set instead of a ball.
    ///
    /// A disturbance t is resisted s times where −s t lies in the hull of the space and the origin (pressing less is
    /// always possible). Each clip below is a supporting plane of that hull between it and the ray's end, so the scale
    /// falls from above onto the answer. With [`crate::QualityOptions::axes`] only the axes that count are looked at; a
    /// task without any wrench along them has the scale ∞.
    pub fn scale(&self, space: &GraspWrenchSpace) -> TaskScale {
        let mut worst = TaskScale {
            scale: f64::INFINITY,
            limiting: 0,
        };
        for (idx, wrench) in self.0.iter().enumerate() {
            let scale = reach_along(space, &-wrench, worst.scale);
            if scale < worst.scale {
                worst = TaskScale { scale, limiting: idx };
            }
        }
        worst
    }
}

/// The largest s ≤ `most` with s × `wrench` in the hull of the space and the origin.
fn reach_along(space: &GraspWrenchSpace, wrench: &Wrench, most: f64) -> f64 {
    let ray = space.coordinates().of(wrench);
    let length = dot(&ray, &ray).sqrt();
    if length == 0.0 {
        return most;
    }
    let ray = ray.map(|c| c / length);
    let size = space.scaled_size();
    let support = |direction: &[f64; 6]| {
        let (reach, point) = space.scaled_support(direction);
        if reach > 0.0 {
            (reach, point)
        } else {
            (0.0, [0.0; 6])
        }
    };
    let mut end = support(&ray).0.min(most * length / space.largest_norm());
    // Every clip is by another face; a handful is usual.
    for _ in 0..200 {
        let target = ray.map(|c| c * end);
        let gap = nearest(
            |d| {
                let (reach, point) = support(d);
                (
                    reach - dot(d, &target),
                    std::array::from_fn(|k| point[k] - target[k]),
                )
            },
            size,
        );
        let distance = dot(&gap, &gap).sqrt();
        if distance <= 1e-12 * size {
            break;
        }
        let normal = gap.map(|c| -c / distance);
        let along = dot(&normal, &ray);
        if along <= 0.0 {
            break;
        }
        let clipped = (support(&normal).0 / along).max(0.0);
        if clipped >= end {
            break;
        }
        end = clipped;
    }
    let scale = end * space.largest_norm() / length;
    if end <= 1e-12 * size { 0.0 } else { scale }
}

/// The unit vector, and `n` more at `angle` from it, evenly round it.
fn around(center: &UnitVector3<f64>, angle: f64, n: usize) -> Vec<Vector3<f64>> {
    let axis = center.into_inner();
    let aside = if axis.x.abs() < 0.9 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let side = Unit::new_normalize(axis.cross(&aside));
    let tilted = UnitQuaternion::from_axis_angle(&side, angle) * axis;
    let turned = (0..n).map(|k| {
        let turn = std::f64::consts::TAU * k as f64 / n as f64;
        UnitQuaternion::from_axis_angle(center, turn) * tilted
    });
    std::iter::once(axis).chain(turned).collect()
}

fn join(force: Vector3<f64>, torque: Vector3<f64>) -> Wrench {
    Wrench::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, EpsilonSolver, QualityOptions};

    fn cube(mu: f64) -> Vec<Contact> {
        [Vector3::x(), Vector3::y(), Vector3::z()]
            .iter()
            .flat_map(|n| [*n, -*n])
            .enumerate()
            .map(|(i, n)| Contact::new(i, Point3::from(-0.05 * n), n, mu, 0.0).unwrap())
            .collect()
    }

    fn space(mu: f64) -> GraspWrenchSpace {
        GraspWrenchSpace::new(&cube(mu), &QualityOptions::new(Point3::origin(), 0.05)).unwrap()
    }

    #[test]
    fn epsilon_is_the_scale_of_the_limiting_wrench() {
        for mu in [0.3, 0.5, 1.0] {
            let space = space(mu);
            let bounds = EpsilonSolver::default().bounds(&space).unwrap();
            let task = TaskWrenches::new(vec![bounds.limiting_wrench]).unwrap();
            assert!((task.scale(&space).scale - bounds.upper).abs() < 1e-10);
        }
    }

    #[test]
    fn a_task_wrench_at_a_corner_of_the_space_has_the_scale_one() {
        // One wrench of one edge of the cone, which no other contact reaches past.
        let space = space(0.5);
        let edge = space.wrenches()[0];
        let task = TaskWrenches::new(vec![-0.5 * edge]).unwrap();
        assert!((task.scale(&space).scale - 2.0).abs() < 1e-9);
    }

    #[test]
    fn without_friction_on_a_cube_weight_is_held_and_twists_are_not() {
        let space = space(0.0);
        let up = Vector3::z_axis();
        let weight = TaskWrenches::new(vec![join(-up.into_inner(), Vector3::zeros())]).unwrap();
        assert!((weight.scale(&space).scale - 1.0).abs() < 1e-10);
        let pouring = TaskWrenches::pouring(&up, &Vector3::x_axis());
        assert_eq!(pouring.wrenches().len(), 20);
        assert_eq!(pouring.scale(&space).scale, 0.0);
    }

    #[test]
    fn every_named_task_is_resisted_by_a_firm_grasp() {
        let space = space(1.0);
        let (up, x) = (Vector3::z_axis(), Vector3::x_axis());
        let head = Point3::new(0.1, 0.0, 0.0);
        let hammering = TaskWrenches::hammering(&head, &-up, &Point3::origin(), 0.05);
        assert_eq!(hammering.wrenches().len(), 11);
        for task in [
            TaskWrenches::pouring(&up, &x),
            hammering,
            TaskWrenches::handing_over(&up, &x),
        ] {
            let found = task.scale(&space);
            assert!(found.scale > 0.01 && found.scale < 2.0, "{found:?}");
            // No wrench of the task, scaled so, passes any plane that holds the space.
            for wrench in task.wrenches() {
                let (reach, _) = space.support(&-wrench.normalize());
                assert!(found.scale * wrench.norm() <= reach + 1e-9);
            }
        }
    }

    #[test]
    fn the_weight_turns_towards_the_spout() {
        // Tilted by 90° about x, up (z) has gone to −y of the world: the weight pulls along −y … seen from the object.
        let task = TaskWrenches::pouring(&Vector3::z_axis(), &Vector3::x_axis());
        let tilted = task.wrenches()[12];
        assert!((tilted.fixed_rows::<3>(0) - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn empty_tasks_and_zero_wrenches_are_errors() {
        assert_eq!(TaskWrenches::new(vec![]), Err(QualityError::NoTaskWrenches));
        let error = TaskWrenches::new(vec![Wrench::repeat(1.0), Wrench::zeros()]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "task wrench 1 is [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]; expected a finite wrench other than zero"
        );
    }
}
