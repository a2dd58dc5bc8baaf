//! Draws what ε means, in the plane: three fingers on a disc, the forces that they can give together, the largest circle
//! about the origin inside them, and the push that they resist least. Prints an SVG:
//! `cargo run -p prehend-quality --example epsilon_in_the_plane > epsilon.svg`

use nalgebra::{Point3, Vector3};
use prehend_geometry::planar_hull;
use prehend_quality::{Contact, EpsilonSolver, GraspWrenchSpace, QualityOptions, WrenchAxes};

fn main() -> Result<(), prehend_quality::QualityError> {
    let mu = 0.4;
    let fingers: Vec<Contact> = [0.5_f64, 2.4, 4.4]
        .iter()
        .enumerate()
        .map(|(i, angle)| {
            let out = Vector3::new(angle.cos(), angle.sin(), 0.0);
            Contact::new(i, Point3::from(out), -out, mu, 0.0)
        })
        .collect::<Result<_, _>>()?;
    let axes = WrenchAxes::new([true, true, false, false, false, false])?;
    let options = QualityOptions {
        axes,
        ..QualityOptions::new(Point3::origin(), 1.0)
    };
    let space = GraspWrenchSpace::new(&fingers, &options)?;
    let bounds = EpsilonSolver::default().bounds(&space)?;
    let (epsilon, worst) = (bounds.upper, bounds.limiting_wrench);

    let forces: Vec<[f64; 2]> = space.wrenches().iter().map(|w| [w[0], w[1]]).collect();
    let corners: Vec<String> = planar_hull(&forces)
        .iter()
        .map(|&i| forces[i as usize])
        .map(|[x, y]| format!("{:.1},{:.1}", 100.0 * x, -100.0 * y))
        .collect();
    println!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="-340 -130 520 260" font-family="sans-serif" font-size="10">"#
    );
    println!(r#"<rect x="-340" y="-130" width="520" height="260" fill="white"/>"#);
    println!(
        r##"<circle cx="-225" cy="0" r="60" fill="#dde6ee" stroke="#556"/><text x="-300" y="-110">a disc and three fingers, μ = {mu}</text>"##
    );
    for finger in &fingers {
        let (p, n) = (finger.at.point, finger.at.normal);
        let (x, y) = (-225.0 + 60.0 * p.x, -60.0 * p.y);
        for side in [-mu, 0.0, mu] {
            let f = Vector3::new(n.x - side * n.y, n.y + side * n.x, 0.0) * 38.0;
            println!(
                r##"<line x1="{x:.1}" y1="{y:.1}" x2="{:.1}" y2="{:.1}" stroke="#c50"/>"##,
                x + f.x,
                y - f.y
            );
        }
    }
    println!(r#"<text x="-60" y="-110">forces that they can give, ε = {epsilon:.3}</text>"#);
    println!(
        r##"<polygon points="{}" fill="#fde8d8" stroke="#c50"/>"##,
        corners.join(" ")
    );
    println!(
        r##"<circle r="{:.1}" fill="#cfe3f5" stroke="#06c"/><circle r="2"/>"##,
        100.0 * epsilon
    );
    let (x, y) = (100.0 * epsilon * worst[0], -100.0 * epsilon * worst[1]);
    println!(r##"<line x2="{x:.1}" y2="{y:.1}" stroke="#06c" stroke-width="2"/>"##);
    println!(
        r##"<line x2="{:.1}" y2="{:.1}" stroke="#06c" stroke-dasharray="4 3"/>"##,
        -x, -y
    );
    println!(
        r##"<text x="-300" y="122" fill="#06c">solid: the push resisted least; dashed: the force that answers it</text></svg>"##
    );
    Ok(())
}
