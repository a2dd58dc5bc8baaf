//! Pictures against closed forms: areas of silhouettes, what hides what, and what must not break.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, Vector3};
use prehend_geometry::{OrientedBox, Solid, TriMesh};
use prehend_report::{
    Body, Camera, DisplayMesh, Dot, DrawOptions, Raster, ReportError, Scene, View, draw, encode_png,
    looking_from,
};

fn shape(solid: &Solid) -> Arc<DisplayMesh> {
    Arc::new(DisplayMesh::new(&solid.display_mesh()))
}

fn plain(size: usize) -> DrawOptions {
    DrawOptions {
        width: size,
        height: size,
        samples: 3,
        lines: false,
    }
}

fn camera(camera_from_world: Rotation3<f64>, half_size: f64) -> Camera {
    Camera {
        camera_from_world,
        center: Point3::origin(),
        half_size,
    }
}

/// Covered area in square metres, from alpha.
fn area(raster: &Raster, camera: &Camera) -> f64 {
    let covered: f64 = raster.rgba.chunks(4).map(|p| f64::from(p[3]) / 255.0).sum();
    covered * (2.0 * camera.half_size / raster.width.min(raster.height) as f64).powi(2)
}

fn pixel(raster: &Raster, x: usize, y: usize) -> [u8; 4] {
    let at = 4 * (y * raster.width + x);
    raster.rgba[at..at + 4].try_into().unwrap()
}

#[test]
fn a_cube_from_a_face_an_edge_and_a_corner() {
    let mut scene = Scene::default();
    scene.add(
        &shape(&Solid::Cuboid {
            half_extents: Vector3::repeat(0.5),
        }),
        Isometry3::identity(),
        [200; 3],
    );
    // Elevation of the body diagonal: asin(1/√3).
    let diagonal = (1.0_f64 / 3.0_f64.sqrt()).asin().to_degrees();
    for (rotation, expected) in [
        (View::Front.camera_from_world(), 1.0),
        (looking_from(0.0, 45.0), 2.0_f64.sqrt()),
        (looking_from(diagonal, 45.0), 3.0_f64.sqrt()),
    ] {
        let camera = camera(rotation, 1.0);
        let found = area(&draw(&scene, &camera, &plain(240)).unwrap(), &camera);
        assert!(
            (found - expected).abs() < 0.004 * expected,
            "expected {expected}, found {found}"
        );
    }
}

#[test]
fn a_ball_is_a_disc_from_everywhere_and_fills_its_fitted_picture() {
    let scene = Scene::object(&shape(&Solid::Sphere { radius: 0.05 }));
    for view in View::SIX.into_iter().chain([View::Oblique]) {
        let camera = Camera::fitting(&scene, view.camera_from_world(), 160, 160);
        let found = area(&draw(&scene, &camera, &plain(160)).unwrap(), &camera);
        let disc = std::f64::consts::PI * 0.05_f64.powi(2);
        assert!(
            (0.93..1.001).contains(&(found / disc)),
            "{view:?}: {}",
            found / disc
        );
        assert!(
            (camera.half_size / 0.052 - 1.0).abs() < 0.02,
            "{view:?}: {}",
            camera.half_size
        );
    }
}

#[test]
fn the_nearer_body_hides_the_farther_whatever_their_order() {
    let cube = shape(&Solid::Cuboid {
        half_extents: Vector3::repeat(0.5),
    });
    let at = |x: f64, color| Body {
        mesh: Arc::clone(&cube),
        pose: Translation3::new(x, 0.0, 0.0).into(),
        color,
        opacity: 1.0,
    };
    let (near, far) = (at(2.0, [255, 0, 0]), at(-2.0, [0, 0, 255]));
    for bodies in [vec![near.clone(), far.clone()], vec![far, near]] {
        let scene = Scene {
            bodies,
            ..Scene::default()
        };
        let front = draw(&scene, &camera(View::Front.camera_from_world(), 1.0), &plain(20)).unwrap();
        let back = draw(&scene, &camera(View::Back.camera_from_world(), 1.0), &plain(20)).unwrap();
        assert!(pixel(&front, 10, 10)[0] > 100 && pixel(&front, 10, 10)[2] == 0);
        assert!(pixel(&back, 10, 10)[2] > 100 && pixel(&back, 10, 10)[0] == 0);
    }
}

#[test]
fn both_sides_of_an_open_mesh_are_lit() {
    let vertices = vec![
        Point3::new(0.0, -1.0, -1.0),
        Point3::new(0.0, 1.0, -1.0),
        Point3::new(0.0, 0.0, 1.0),
    ];
    let mesh = TriMesh::new(vertices, vec![[0, 1, 2]]).unwrap();
    let scene = Scene::object(&Arc::new(DisplayMesh::new(&mesh)));
    let front = draw(&scene, &camera(View::Front.camera_from_world(), 1.5), &plain(30)).unwrap();
    let back = draw(&scene, &camera(View::Back.camera_from_world(), 1.5), &plain(30)).unwrap();
    assert_eq!(pixel(&front, 15, 15), pixel(&back, 15, 15));
    assert!(pixel(&front, 15, 15)[0] > 60);
}

#[test]
fn what_is_drawn_depends_on_nothing_but_the_scene() {
    let mut scene = Scene::object(&shape(&Solid::Capsule {
        half_length: 0.05,
        radius: 0.02,
    }));
    scene.add_box(&OrientedBox::centered([0.05, 0.05, 0.15]), [0, 114, 178]);
    scene.dots.push(Dot {
        center: Point3::new(0.02, 0.0, 0.0),
        radius: 2.0,
        color: [200, 0, 100],
    });
    let picture = || {
        scene
            .telling_picture(64, "capsule", "a capsule in its box")
            .unwrap()
    };
    let first = picture();
    let threads: Vec<_> = (0..2)
        .map(|_| std::thread::scope(|s| s.spawn(picture).join().unwrap()))
        .collect();
    assert!(threads.iter().all(|p| *p == first));
    assert_eq!(first.size().unwrap(), (64, 64));
}

#[test]
fn nothing_to_draw_gives_a_clear_picture() {
    let scene = Scene::default();
    let camera = Camera::fitting(&scene, View::Top.camera_from_world(), 8, 4);
    let raster = draw(
        &scene,
        &camera,
        &DrawOptions {
            width: 8,
            height: 4,
            samples: 2,
            lines: true,
        },
    )
    .unwrap();
    assert!(raster.rgba.iter().all(|b| *b == 0));
    assert_eq!(raster.rgba.len(), 8 * 4 * 4);
}

#[test]
fn impossible_sizes_say_so() {
    let scene = Scene::default();
    let camera = Camera::fitting(&scene, View::Top.camera_from_world(), 1, 1);
    let error = draw(&scene, &camera, &DrawOptions::square(0)).unwrap_err();
    assert_eq!(error, ReportError::PictureSize { width: 0, height: 0 });
    assert_eq!(
        error.to_string(),
        "a picture of 0 × 0 pixels: expected 1 to 8192 along each side"
    );
}

#[test]
fn a_png_of_few_colours_is_exact_and_of_many_is_close() {
    let decode = |bytes: &[u8]| {
        let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::ALPHA);
        let mut reader = decoder.read_info().unwrap();
        let mut rgba = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgba).unwrap();
        rgba
    };
    let few = Raster {
        width: 2,
        height: 1,
        rgba: vec![10, 20, 30, 255, 0, 0, 0, 0],
    };
    assert_eq!(decode(&encode_png(&few)), few.rgba);

    // 64 × 64 colours of two ramps.
    let rgba: Vec<u8> = (0..4096_u32)
        .flat_map(|i| [(i % 64 * 4) as u8, (i / 64 * 4) as u8, 128, 255])
        .collect();
    let many = Raster {
        width: 64,
        height: 64,
        rgba,
    };
    let found = decode(&encode_png(&many));
    let error: f64 = many
        .rgba
        .iter()
        .zip(&found)
        .map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2))
        .sum::<f64>()
        / 4096.0;
    // 256 cells of 16 × 16 levels each have a variance of 2 · 16²/12 about their means.
    assert!(error < 2.0 * 256.0 / 12.0 * 1.2, "{error}");
}
