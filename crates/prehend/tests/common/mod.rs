//! A small run of the pipeline on bundled data, and what it wrote.

#![allow(dead_code, reason = "each test file uses a part of it")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{LazyLock, Mutex};
use std::time::SystemTime;

use prehend::labels::{Answer, LabelStore};
use prehend::pipeline::{PipelineOptions, PipelineSummary, run};
use prehend::progress::{Progress, Watch};
use prehend::{Error, files};
use prehend_tutor::Persona;

/// A folder of the repository.
pub fn repository(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder)
}

/// A folder with copies of bundled objects, `TYPE/NAME` each, and room for the output.
pub fn workplace(objects: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for object in objects {
        for extension in ["ply", "toml"] {
            let to = folder
                .path()
                .join("objects")
                .join(object)
                .with_extension(extension);
            fs::create_dir_all(to.parent().unwrap()).unwrap();
            fs::copy(repository("objects").join(object).with_extension(extension), to).unwrap();
        }
    }
    folder
}

/// Settings of a run on the objects of a workplace, into its folder `out`.
pub fn options(workplace: &Path, hands: &str, out: &str, tries: usize) -> PipelineOptions {
    PipelineOptions {
        quick: false,
        objects: workplace.join("objects"),
        hands: repository(hands),
        networks: repository("networks"),
        experiments: None,
        out: workplace.join(out),
        seed: 7,
        tries: Some(tries),
        arguments: vec!["pipeline".into()],
    }
}

/// Keeps warnings, and asks to stop once a part of the run has come so far.
#[derive(Default)]
pub struct Listener {
    pub stop: AtomicBool,
    pub warnings: Mutex<Vec<String>>,
    stop_in: Option<(&'static str, usize)>,
    part: Mutex<String>,
    steps: AtomicUsize,
}

impl Listener {
    /// Asks to stop after so many steps of the part with this name.
    pub fn stopping_in(part: &'static str, steps: usize) -> Self {
        Self {
            stop_in: Some((part, steps)),
            ..Self::default()
        }
    }

    fn look(&self) {
        if let Some((part, steps)) = self.stop_in
            && *self.part.lock().unwrap() == part
            && self.steps.load(Ordering::SeqCst) >= steps
        {
            self.stop.store(true, Ordering::SeqCst);
        }
    }
}

impl Progress for Listener {
    fn begin(&self, name: &str, _total: u64) {
        name.clone_into(&mut self.part.lock().unwrap());
        self.steps.store(0, Ordering::SeqCst);
        self.look();
    }

    fn advance(&self, steps: u64) {
        self.steps
            .fetch_add(usize::try_from(steps).unwrap(), Ordering::SeqCst);
        self.look();
    }

    fn warn(&self, message: &str) {
        self.warnings.lock().unwrap().push(message.to_owned());
    }
}

/// Runs the pipeline on a pool of so many threads.
pub fn run_on(
    threads: usize,
    options: &PipelineOptions,
    listener: &Listener,
) -> Result<PipelineSummary, Error> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    let watch = Watch {
        progress: listener,
        stop: &listener.stop,
    };
    pool.install(|| run(options, watch))
}

/// Every file below a folder with its bytes, without what carries the clock: `run.json`, the chart of times, and in the
/// page the section that tells them. `labels.sqlite` is compared by [`labels`].
pub fn snapshot(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let extensions = ["json", "parquet", "csv", "toml", "bin", "html", "svg", "png"];
    files::list(out, &extensions)
        .unwrap()
        .into_iter()
        .map(|path| {
            let name = path.strip_prefix(out).unwrap().to_string_lossy().into_owned();
            (name, fs::read(&path).unwrap())
        })
        .filter(|(name, _)| name != "run.json" && !name.contains("stage-times"))
        .map(|(name, bytes)| {
            let bytes = if name == "report/index.html" {
                without_times(&String::from_utf8(bytes).unwrap()).into_bytes()
            } else {
                bytes
            };
            (name, bytes)
        })
        .collect()
}

/// The page without its section on the run, the only one with times.
fn without_times(page: &str) -> String {
    let begin = page
        .find("<section id=\"run\"")
        .expect("the page tells of the run");
    let end = begin + page[begin..].find("</section>").unwrap();
    format!("{}{}", &page[..begin], &page[end..])
}

/// Every persona's answers, grasp by grasp.
pub fn labels(out: &Path) -> BTreeMap<String, BTreeMap<String, Vec<Answer>>> {
    let store = LabelStore::open(&out.join("labels.sqlite")).unwrap();
    Persona::ALL
        .into_iter()
        .map(|p| (p.name().to_owned(), store.answers(p.name(), &[]).unwrap()))
        .collect()
}

/// When each file below a folder was last written.
pub fn written(folder: &Path) -> BTreeMap<PathBuf, SystemTime> {
    files::list(folder, &["json", "parquet", "bin"])
        .unwrap()
        .into_iter()
        .map(|path| {
            let time = fs::metadata(&path).unwrap().modified().unwrap();
            (path, time)
        })
        .collect()
}

/// Fails with the names of the files that differ.
pub fn assert_same(a: &Path, b: &Path) {
    let (left, right) = (snapshot(a), snapshot(b));
    let names = |s: &BTreeMap<String, Vec<u8>>| s.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&left), names(&right));
    let different: Vec<_> = left
        .iter()
        .filter(|(name, bytes)| right[*name] != **bytes)
        .collect();
    let names: Vec<&String> = different.iter().map(|(name, _)| *name).collect();
    assert!(names.is_empty(), "these files differ: {names:?}");
    assert!(labels(a) == labels(b), "the labels differ");
}

/// The run that others are compared with: both hands, two objects of three types, one thread.
pub static BASELINE: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let place = workplace(&[
        "bottle/beer_bottle",
        "bottle/wine_bottle",
        "hammer/ball_hammer",
        "hammer/rubber_mallet",
        "mug/camping_cup",
        "mug/coffee_mug",
    ]);
    run_on(
        1,
        &options(place.path(), "hands", "one", TRIES),
        &Listener::default(),
    )
    .unwrap();
    place
});

/// Tries per hand and object of [`BASELINE`].
pub const TRIES: usize = 60;
