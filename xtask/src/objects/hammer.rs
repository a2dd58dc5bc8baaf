//! Hammers: a head that travels from its striking face backwards, and a handle grown from its eye.

use super::curve::Track;
use super::model::{Drawing, PartBox, boxes_along};
use super::shell::{Hole, Part, Ring, Shell};
use super::sweep::{Frame, around, around_hole, place, superellipse};
use nalgebra::{Point3, Vector3};

/// All hammers.
pub fn all() -> Vec<Drawing> {
    vec![claw(), ball(), club(), mallet()]
}

/// How a hammer is put together.
struct Hammer<'a> {
    name: &'static str,
    /// Along the head from the face: [x, z, half width, half height, power]; the eye is even steps on this track.
    head: &'a [(f64, [f64; 5])],
    head_step: f64,
    /// Columns around the head, a multiple of 8.
    columns: usize,
    /// Where the eye lies along the head, and its rows; its columns are those of the underside but `margin` on both sides.
    eye: [f64; 2],
    eye_rows: usize,
    margin: usize,
    tail: Tail<'a>,
    /// Down the handle from the eye: distance below the head's underside → [x, half length (x), half width (y), power].
    handle: &'a [(f64, [f64; 4])],
    handle_step: f64,
    /// Distances below the head between which the grip lies.
    grip: [f64; 2],
    material: &'static str,
    /// kg/m³ of handle and head.
    densities: [f64; 2],
    least_thickness: f64,
}

/// What the head ends with.
enum Tail<'a> {
    /// A fan: a second face, or the pole of a ball that stands out by so much.
    Round(f64),
    /// Two prongs, from the head's last station on: [x, z, half width, half height, half gap].
    Claw(&'a [(f64, [f64; 5])]),
}

fn draw(hammer: &Hammer) -> Drawing {
    let mut shell = Shell::new(Part::Functional);
    let rings = head(&mut shell, hammer);
    let row = rings.0;
    let columns = hammer.columns / 8 + hammer.margin..3 * hammer.columns / 8 - hammer.margin;
    let eye = Hole {
        rows: row..row + hammer.eye_rows,
        columns,
    };
    shell.weave(&rings.1, std::slice::from_ref(&eye));
    let first = &rings.1[0];
    let face = shell.mean(first);
    shell.cap_start(first, face);
    match hammer.tail {
        Tail::Round(out) => {
            let last = &rings.1[rings.1.len() - 1];
            let pole = shell.mean(last) - out * Vector3::x();
            shell.cap_end(last, pole);
        }
        Tail::Claw(track) => claws(&mut shell, &rings.1[rings.1.len() - 1], track),
    }
    let functional = vec![PartBox::around(&shell.points, 0.2)];

    shell.start(Part::Handle);
    let edge = eye.edge(&rings.1);
    let top = shell.mean(&edge);
    let angles = around_hole(eye.columns.len(), eye.rows.len());
    let track = Track::new(hammer.handle);
    let down = track.steps(hammer.handle_step);
    let mut tube = vec![edge];
    for &d in &down {
        let [x, half_x, half_y, power] = track.at(d);
        let frame = Frame {
            origin: Point3::new(x, 0.0, top.z - d),
            side: -Vector3::y(),
            up: -Vector3::x(),
        };
        tube.push(place(
            &mut shell,
            &frame,
            angles.iter().map(|&a| superellipse(a, half_y, half_x, power)),
        ));
    }
    shell.weave(&tube, &[]);
    shell.cap_end_flat(&tube[tube.len() - 1]);
    let within = |d: f64| d >= hammer.grip[0] - 1e-9 && d <= hammer.grip[1] + 1e-9;
    let grip: Vec<Ring> = down
        .iter()
        .zip(&tube[1..])
        .filter(|(d, _)| within(**d))
        .map(|(_, ring)| ring.clone())
        .collect();
    let handle = boxes_along(&shell, &grip, 3);

    let butt = shell.points.iter().map(|p| p.z).fold(f64::MAX, f64::min);
    let lift = |mut part: PartBox| {
        part.center[2] -= butt;
        part
    };
    for point in &mut shell.points {
        point.z -= butt;
    }
    Drawing {
        kind: "hammer",
        name: hammer.name,
        shell,
        densities: [hammer.densities[0], hammer.densities[0], hammer.densities[1]],
        material: hammer.material,
        opening: None,
        handle: handle.into_iter().map(lift).collect(),
        functional: functional.into_iter().map(lift).collect(),
        sharp: vec![],
        least_thickness: hammer.least_thickness,
    }
}

/// Rings of the head from the face backwards, and the index of the eye's first ring.
fn head(shell: &mut Shell, hammer: &Hammer) -> (usize, Vec<Ring>) {
    let track = Track::new(hammer.head);
    let [from, to] = hammer.eye;
    let margin = 0.5 * (to - from) / hammer.eye_rows as f64;
    let mut along: Vec<f64> = track
        .steps(hammer.head_step)
        .into_iter()
        .filter(|s| *s < from - margin || *s > to + margin)
        .collect();
    let row = along.partition_point(|s| *s < from);
    let rows = (0..=hammer.eye_rows).map(|k| from + (to - from) * k as f64 / hammer.eye_rows as f64);
    along.splice(row..row, rows);
    let angles = around(hammer.columns);
    let rings = along
        .iter()
        .map(|&s| {
            let [_, _, half_width, half_height, power] = track.at(s);
            let frame = frame_on(&|s| [track.at(s)[0], track.at(s)[1]], s);
            place(
                shell,
                &frame,
                angles
                    .iter()
                    .map(|&a| superellipse(a, half_width, half_height, power)),
            )
        })
        .collect();
    (row, rings)
}

/// Frame at `s` on a path in the x–z plane that travels towards −x: side along −y.
fn frame_on(path: &dyn Fn(f64) -> [f64; 2], s: f64) -> Frame {
    let (here, before, after) = (path(s), path(s - 0.01), path(s + 0.01));
    let travel = Vector3::new(after[0] - before[0], 0.0, after[1] - before[1]).normalize();
    Frame {
        origin: Point3::new(here[0], 0.0, here[1]),
        side: -Vector3::y(),
        up: travel.cross(&-Vector3::y()),
    }
}

/// Splits the last ring of a head into two prongs that share the bottom of the notch.
fn claws(shell: &mut Shell, last: &[usize], stations: &[(f64, [f64; 5])]) {
    const ACROSS: usize = 4;
    let track = Track::new(stations);
    let along = track.steps(4.0);
    let n = last.len();
    let (low, high) = (n / 4, 3 * n / 4);
    let [_, _, _, half_height, _] = track.at(along[0]);
    let path = |s: f64| [track.at(s)[0], track.at(s)[1]];
    let start = frame_on(&path, along[0]);
    let notch: Ring = (1..ACROSS)
        .map(|k| shell.point(start.at([0.0, half_height * (1.0 - 2.0 * k as f64 / ACROSS as f64)])))
        .collect();
    for side in [1.0, -1.0] {
        let mut rings: Vec<Ring> = Vec::new();
        for &s in &along {
            let [_, _, half_width, half_height, half_gap] = track.at(s);
            if rings.is_empty() {
                let ring = if side > 0.0 {
                    (low..=high)
                        .map(|k| last[k])
                        .chain(notch.iter().copied())
                        .collect()
                } else {
                    (high..=n + low)
                        .map(|k| last[k % n])
                        .chain(notch.iter().rev().copied())
                        .collect()
                };
                rings.push(ring);
                continue;
            }
            let frame = frame_on(&path, s);
            let half: Vec<[f64; 2]> = (0..=n / 2)
                .map(|k| {
                    let angle = side * std::f64::consts::PI * (k as f64 / (n / 2) as f64 - 0.5);
                    let [a, b] = superellipse(angle, 1.0, half_height, 4.0);
                    [side * (half_gap + a.abs() * (half_width - half_gap)), b]
                })
                .collect();
            let inner = (1..ACROSS).map(|k| {
                let b = half_height * (1.0 - 2.0 * k as f64 / ACROSS as f64);
                [side * half_gap, side * b]
            });
            rings.push(place(shell, &frame, half.into_iter().chain(inner)));
        }
        shell.weave(&rings, &[]);
        shell.cap_end_flat(&rings[rings.len() - 1]);
    }
}

/// A carpenter's hammer: round face, curved claw, wooden handle.
fn claw() -> Drawing {
    draw(&Hammer {
        name: "claw_hammer",
        head: &[
            (0.0, [47.0, 0.0, 13.2, 13.2, 2.0]),
            (1.5, [45.5, 0.0, 14.6, 14.6, 2.0]),
            (13.0, [34.0, 0.0, 14.8, 14.8, 2.0]),
            (16.0, [31.0, 0.0, 13.2, 13.2, 2.0]),
            (22.0, [25.0, 0.0, 10.6, 10.8, 2.2]),
            (32.0, [15.0, 0.0, 13.6, 13.0, 4.0]),
            (62.0, [-15.0, 0.0, 13.6, 13.0, 4.0]),
            (72.0, [-25.0, -0.6, 13.4, 10.0, 4.0]),
            (82.0, [-35.0, -3.0, 13.6, 7.2, 4.0]),
        ],
        head_step: 4.5,
        columns: 32,
        eye: [34.0, 60.0],
        eye_rows: 8,
        margin: 1,
        tail: Tail::Claw(&[
            (82.0, [-35.0, -3.0, 13.6, 7.2, 0.0]),
            (92.0, [-44.4, -6.6, 14.4, 5.6, 1.3]),
            (104.0, [-54.8, -12.6, 15.4, 4.2, 2.8]),
            (116.0, [-64.2, -20.0, 16.2, 3.0, 4.3]),
            (126.0, [-71.4, -27.0, 16.6, 1.5, 5.6]),
        ]),
        handle: &[
            (1.2, [0.0, 12.6, 8.4, 3.0]),
            (20.0, [0.0, 12.0, 8.6, 2.6]),
            (90.0, [0.0, 10.6, 9.2, 2.3]),
            (170.0, [0.0, 13.6, 10.4, 2.3]),
            (265.0, [0.0, 15.2, 11.8, 2.3]),
            (290.0, [0.0, 17.6, 13.4, 2.3]),
            (300.0, [0.0, 17.2, 13.0, 2.3]),
            (305.0, [0.0, 15.0, 11.0, 2.3]),
            (306.5, [0.0, 11.0, 8.0, 2.3]),
        ],
        handle_step: 9.0,
        grip: [150.0, 306.5],
        material: "wood",
        densities: [720.0, 7800.0],
        least_thickness: 2.0,
    })
}

/// An engineer's hammer: round face, ball behind, slim wooden handle.
fn ball() -> Drawing {
    draw(&Hammer {
        name: "ball_hammer",
        head: &[
            (0.0, [44.0, 0.0, 11.6, 11.6, 2.0]),
            (1.5, [42.5, 0.0, 13.4, 13.4, 2.0]),
            (13.0, [31.0, 0.0, 13.4, 13.4, 2.0]),
            (16.0, [28.0, 0.0, 11.2, 11.2, 2.0]),
            (22.0, [22.0, 0.0, 9.2, 9.4, 2.1]),
            (31.0, [13.0, 0.0, 11.6, 11.0, 4.0]),
            (57.0, [-13.0, 0.0, 11.6, 11.0, 4.0]),
            (63.0, [-19.0, 0.0, 8.6, 8.6, 2.2]),
            (66.0, [-22.0, 0.0, 8.0, 8.0, 2.0]),
            (69.0, [-25.0, 0.0, 9.6, 9.6, 2.0]),
            (73.0, [-29.0, 0.0, 11.4, 11.4, 2.0]),
            (77.0, [-33.0, 0.0, 12.0, 12.0, 2.0]),
            (81.0, [-37.0, 0.0, 11.3, 11.3, 2.0]),
            (84.5, [-40.5, 0.0, 9.4, 9.4, 2.0]),
            (87.0, [-43.0, 0.0, 6.6, 6.6, 2.0]),
            (88.4, [-44.4, 0.0, 3.7, 3.7, 2.0]),
        ],
        head_step: 4.0,
        columns: 32,
        eye: [33.0, 55.0],
        eye_rows: 7,
        margin: 1,
        tail: Tail::Round(0.6),
        handle: &[
            (1.2, [0.0, 10.2, 7.0, 3.0]),
            (20.0, [0.0, 9.4, 7.2, 2.6]),
            (70.0, [0.0, 7.8, 6.8, 2.2]),
            (140.0, [0.0, 10.8, 8.8, 2.2]),
            (225.0, [0.0, 13.2, 10.4, 2.2]),
            (250.0, [0.0, 12.8, 10.2, 2.2]),
            (256.0, [0.0, 10.6, 8.4, 2.2]),
            (257.5, [0.0, 7.5, 6.0, 2.2]),
        ],
        handle_step: 7.5,
        grip: [115.0, 257.5],
        material: "wood",
        densities: [720.0, 7800.0],
        least_thickness: 5.0,
    })
}

/// A short heavy club hammer with two square faces.
fn club() -> Drawing {
    draw(&Hammer {
        name: "club_hammer",
        head: &[
            (0.0, [48.0, 0.0, 17.5, 17.5, 4.0]),
            (3.0, [45.0, 0.0, 20.5, 20.5, 4.5]),
            (20.0, [28.0, 0.0, 21.0, 21.0, 5.0]),
            (76.0, [-28.0, 0.0, 21.0, 21.0, 5.0]),
            (93.0, [-45.0, 0.0, 20.5, 20.5, 4.5]),
            (96.0, [-48.0, 0.0, 17.5, 17.5, 4.0]),
        ],
        head_step: 5.0,
        columns: 40,
        eye: [32.0, 64.0],
        eye_rows: 8,
        margin: 1,
        tail: Tail::Round(0.0),
        handle: &[
            (1.5, [0.0, 15.4, 13.4, 3.0]),
            (14.0, [0.0, 14.8, 12.0, 2.6]),
            (60.0, [0.0, 14.0, 11.0, 2.3]),
            (120.0, [0.0, 17.0, 13.6, 2.3]),
            (185.0, [0.0, 17.4, 14.4, 2.3]),
            (206.0, [0.0, 20.0, 16.4, 2.3]),
            (214.0, [0.0, 19.0, 15.6, 2.3]),
            (217.0, [0.0, 15.0, 12.0, 2.3]),
        ],
        handle_step: 7.0,
        grip: [90.0, 217.0],
        material: "plastic",
        densities: [1450.0, 7800.0],
        least_thickness: 15.0,
    })
}

/// A rubber mallet: a drum on a long round handle.
fn mallet() -> Drawing {
    draw(&Hammer {
        name: "rubber_mallet",
        head: &[
            (0.0, [58.0, 0.0, 29.0, 29.0, 2.0]),
            (2.5, [55.5, 0.0, 32.0, 32.0, 2.0]),
            (30.0, [28.0, 0.0, 33.5, 33.5, 2.0]),
            (86.0, [-28.0, 0.0, 33.5, 33.5, 2.0]),
            (113.5, [-55.5, 0.0, 32.0, 32.0, 2.0]),
            (116.0, [-58.0, 0.0, 29.0, 29.0, 2.0]),
        ],
        head_step: 6.0,
        columns: 40,
        eye: [44.0, 72.0],
        eye_rows: 6,
        margin: 2,
        tail: Tail::Round(0.0),
        handle: &[
            (4.5, [0.0, 13.0, 12.6, 2.3]),
            (14.0, [0.0, 12.6, 12.6, 2.0]),
            (150.0, [0.0, 13.4, 13.4, 2.0]),
            (270.0, [0.0, 15.4, 15.4, 2.0]),
            (284.0, [0.0, 14.8, 14.8, 2.0]),
            (288.0, [0.0, 12.0, 12.0, 2.0]),
            (289.0, [0.0, 8.5, 8.5, 2.0]),
        ],
        handle_step: 9.0,
        grip: [140.0, 289.0],
        material: "wood",
        densities: [720.0, 1200.0],
        least_thickness: 10.0,
    })
}
