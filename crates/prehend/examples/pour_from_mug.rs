//! Which grasps hold a mug, and which of them would a tutor pour with?
//!
//! Run with `cargo run -p prehend --example pour_from_mug`.

use std::path::Path;

use prehend::grasp_table::records;
use prehend::progress::unwatched;
use prehend::stages::decompose::shape_of;
use prehend::stages::label::{label, observe_all, tutor_object};
use prehend::stages::synthesize::{HandData, grasp};
use prehend::{Error, ObjectOptions};
use prehend_grasp::SynthesisOptions;
use prehend_tutor::{Persona, TutorHand};

fn main() -> Result<(), Error> {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let hand = HandData::read(&repository.join("hands/schunk_sdh"))?;
    let mug = shape_of(
        &repository.join("objects/mug/coffee_mug.ply"),
        ObjectOptions::default(),
    )?;
    println!("{}: {} boxes", mug.object.name, mug.decomposition.boxes.len());

    let options = SynthesisOptions {
        tries: 150,
        seed: 1,
        ..SynthesisOptions::default()
    };
    let (table, tries) = grasp(&hand, &mug, &options, unwatched())?;
    println!("{} of {} tries hold", tries.kept, tries.tried);

    let grasps = records(&table, &hand.hand)?;
    let tutor_hand = TutorHand::new(&hand.hand).map_err(Error::input)?;
    let seen = observe_all(&tutor_hand, &tutor_object(&mug)?, &grasps);
    let labelled = label(&grasps, &seen, Persona::Strict, options.seed, 0.0);
    let pours = |l: &prehend::labels::Labelled| l.answers.iter().any(|a| a.task == "pouring" && a.yes);
    let mut pouring: Vec<_> = grasps.iter().zip(&labelled).filter(|(_, l)| pours(l)).collect();
    println!("{} of them leave the opening free for pouring", pouring.len());

    pouring.sort_by(|a, b| b.0.epsilon.total_cmp(&a.0.epsilon));
    if let Some((best, _)) = pouring.first() {
        println!("the firmest: {}, epsilon {:.4}", best.grasp_id, best.epsilon);
    }
    Ok(())
}
