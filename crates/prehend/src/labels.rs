//! Who said what of which grasp: an append-only SQLite file.

use std::collections::BTreeMap;
use std::path::Path;

use rusqlite::{Connection, OptionalExtension, Transaction, params};

use crate::Error;

/// Marks the file as ours (`PRAGMA application_id`): "prhd".
const APPLICATION_ID: i64 = 0x7072_6864;

const SCHEMA: &str = "
CREATE TABLE IF NOT EXISTS session (
    id INTEGER PRIMARY KEY, tutor TEXT NOT NULL, persona TEXT NOT NULL, seed INTEGER NOT NULL,
    dataset TEXT NOT NULL, hand TEXT NOT NULL, object TEXT NOT NULL, object_type TEXT NOT NULL, at TEXT NOT NULL,
    UNIQUE (tutor, persona, seed, dataset)
) STRICT;
CREATE TABLE IF NOT EXISTS event (
    seq INTEGER PRIMARY KEY AUTOINCREMENT, session INTEGER NOT NULL REFERENCES session(id), grasp TEXT NOT NULL,
    at TEXT NOT NULL
) STRICT;
CREATE TABLE IF NOT EXISTS event_task (
    event INTEGER NOT NULL REFERENCES event(seq), task TEXT NOT NULL, answer TEXT NOT NULL CHECK (answer IN ('yes','no')),
    probability REAL NOT NULL, rule TEXT NOT NULL, PRIMARY KEY (event, task)
) STRICT, WITHOUT ROWID;
CREATE INDEX IF NOT EXISTS event_by_session ON event(session);
CREATE TRIGGER IF NOT EXISTS event_is_kept BEFORE DELETE ON event BEGIN SELECT RAISE(ABORT, 'labels are append-only'); END;
CREATE TRIGGER IF NOT EXISTS event_is_final BEFORE UPDATE ON event BEGIN SELECT RAISE(ABORT, 'labels are append-only'); END;
CREATE TRIGGER IF NOT EXISTS answer_is_kept BEFORE DELETE ON event_task BEGIN SELECT RAISE(ABORT, 'labels are append-only'); END;
CREATE TRIGGER IF NOT EXISTS answer_is_final BEFORE UPDATE ON event_task BEGIN SELECT RAISE(ABORT, 'labels are append-only'); END;
CREATE VIEW IF NOT EXISTS label AS
    SELECT s.tutor, s.persona, s.seed, s.dataset, s.hand, s.object, s.object_type, e.grasp, t.task, t.answer,
           t.probability, t.rule, e.at, e.seq
    FROM event e JOIN session s ON s.id = e.session JOIN event_task t ON t.event = e.seq;
";

/// The labels of one run.
pub struct LabelStore {
    connection: Connection,
}

/// What was labelled in one go: one tutor, one persona, one grasp table.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// `scripted`, or a person's name.
    pub tutor: String,
    /// The scripted tutor's persona; empty for a person.
    pub persona: String,
    /// Seed of the draws.
    pub seed: u64,
    /// Fingerprint of the grasp table.
    pub dataset: String,
    /// The hand's name.
    pub hand: String,
    /// The object's name.
    pub object: String,
    /// The object's type.
    pub object_type: String,
}

/// The answers for one grasp, one per task that was asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Labelled {
    /// Which grasp.
    pub grasp_id: String,
    /// Task, answer, the tutor's probability of yes, and the rule that decided.
    pub answers: Vec<Answer>,
}

/// One task's answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The task's name.
    pub task: String,
    /// Whether the grasp affords it.
    pub yes: bool,
    /// The tutor's probability of yes; 1 or 0 for a person.
    pub probability: f64,
    /// The rule that decided.
    pub rule: String,
}

impl LabelStore {
    /// Opens or creates the file.
    ///
    /// # Errors
    ///
    /// [`Error::File`] where it is no label file of ours or cannot be opened.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let fail = |e: rusqlite::Error| Error::file(path, e);
        if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(|e| Error::file(folder, e))?;
        }
        let connection = Connection::open(path).map_err(fail)?;
        connection
            .execute_batch("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON; PRAGMA busy_timeout = 5000; PRAGMA trusted_schema = OFF;")
            .map_err(fail)?;
        let id: i64 = connection
            .query_row("PRAGMA application_id", [], |r| r.get(0))
            .map_err(fail)?;
        let tables: i64 = connection
            .query_row("SELECT count(*) FROM sqlite_master", [], |r| r.get(0))
            .map_err(fail)?;
        if id != APPLICATION_ID && tables > 0 {
            return Err(Error::file(
                path,
                "is an SQLite file of another program; expected labels that prehend wrote",
            ));
        }
        connection
            .execute_batch(&format!("PRAGMA application_id = {APPLICATION_ID}; {SCHEMA}"))
            .map_err(fail)?;
        Ok(Self { connection })
    }

    /// Whether this session's labels are complete already.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] where the store cannot be read.
    pub fn has(&self, session: &Session) -> Result<bool, Error> {
        let found: Option<i64> = self
            .connection
            .query_row(
                "SELECT id FROM session WHERE tutor = ?1 AND persona = ?2 AND seed = ?3 AND dataset = ?4",
                params![
                    session.tutor,
                    session.persona,
                    session.seed.cast_signed(),
                    session.dataset
                ],
                |r| r.get(0),
            )
            .optional()
            .map_err(store_error)?;
        Ok(found.is_some())
    }

    /// Appends one session's labels, all or none. `at` is the tutor's clock, RFC 3339.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] where the store refuses, for example because the disk is full.
    pub fn append(&mut self, session: &Session, labelled: &[Labelled], at: &str) -> Result<(), Error> {
        self.append_all(&[(session.clone(), labelled.to_vec())], at)
    }

    /// [`LabelStore::append`] for several sessions, all or none: the disk is waited for once.
    ///
    /// # Errors
    ///
    /// As [`LabelStore::append`].
    pub fn append_all(&mut self, sessions: &[(Session, Vec<Labelled>)], at: &str) -> Result<(), Error> {
        let transaction = self.connection.transaction().map_err(store_error)?;
        for (session, labelled) in sessions {
            insert(&transaction, session, labelled, at).map_err(store_error)?;
        }
        transaction.commit().map_err(store_error)
    }

    /// The latest answers of one persona, by grasp; only grasps of these datasets where any are named.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] where the store cannot be read.
    pub fn answers(
        &self,
        persona: &str,
        datasets: &[String],
    ) -> Result<BTreeMap<String, Vec<Answer>>, Error> {
        let mut statement = self
            .connection
            .prepare("SELECT grasp, task, answer, probability, rule, seq FROM label WHERE persona = ?1 AND dataset = coalesce(?2, dataset) ORDER BY seq, task")
            .map_err(store_error)?;
        let mut found: BTreeMap<String, (i64, Vec<Answer>)> = BTreeMap::new();
        let all = [None];
        let some: Vec<Option<&String>> = datasets.iter().map(Some).collect();
        for dataset in if datasets.is_empty() { &all[..] } else { &some } {
            let mut rows = statement.query(params![persona, dataset]).map_err(store_error)?;
            while let Some(row) = rows.next().map_err(store_error)? {
                let read = || -> rusqlite::Result<_> {
                    let answer = Answer {
                        task: row.get(1)?,
                        yes: row.get_ref(2)?.as_str()? == "yes",
                        probability: row.get(3)?,
                        rule: row.get(4)?,
                    };
                    Ok((row.get::<_, String>(0)?, answer, row.get::<_, i64>(5)?))
                };
                let (grasp, answer, seq) = read().map_err(store_error)?;
                let entry = found.entry(grasp).or_insert_with(|| (seq, Vec::new()));
                if entry.0 < seq {
                    *entry = (seq, Vec::new());
                }
                if entry.0 == seq {
                    entry.1.push(answer);
                }
            }
        }
        Ok(found
            .into_iter()
            .map(|(grasp, (_, answers))| (grasp, answers))
            .collect())
    }
}

fn insert(
    transaction: &Transaction,
    session: &Session,
    labelled: &[Labelled],
    at: &str,
) -> rusqlite::Result<()> {
    transaction.prepare_cached("INSERT INTO session (tutor, persona, seed, dataset, hand, object, object_type, at) VALUES (?1,?2,?3,?4,?5,?6,?7,?8)")?
        .execute(params![
            session.tutor,
            session.persona,
            session.seed.cast_signed(),
            session.dataset,
            session.hand,
            session.object,
            session.object_type,
            at
        ])?;
    let id = transaction.last_insert_rowid();
    let mut event = transaction.prepare_cached("INSERT INTO event (session, grasp, at) VALUES (?1,?2,?3)")?;
    let mut task = transaction.prepare_cached(
        "INSERT INTO event_task (event, task, answer, probability, rule) VALUES (?1,?2,?3,?4,?5)",
    )?;
    for grasp in labelled {
        event.execute(params![id, grasp.grasp_id, at])?;
        let seq = transaction.last_insert_rowid();
        for answer in &grasp.answers {
            let word = if answer.yes { "yes" } else { "no" };
            task.execute(params![seq, answer.task, word, answer.probability, answer.rule])?;
        }
    }
    Ok(())
}

fn store_error(e: rusqlite::Error) -> Error {
    Error::input(format!("the label store: {e}; what was committed before is kept"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn session(dataset: &str) -> Session {
        let text = |s: &str| s.to_owned();
        Session {
            tutor: text("scripted"),
            persona: text("strict"),
            seed: u64::MAX,
            dataset: text(dataset),
            hand: text("h"),
            object: text("o"),
            object_type: text("mug"),
        }
    }

    fn labelled(yes: bool) -> Vec<Labelled> {
        let answer = Answer {
            task: "pouring".into(),
            yes,
            probability: 0.25,
            rule: "tilt".into(),
        };
        vec![Labelled {
            grasp_id: "h/o/1".into(),
            answers: vec![answer],
        }]
    }

    #[test]
    fn labels_come_back_and_the_latest_counts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("labels.sqlite");
        let mut store = LabelStore::open(&path).unwrap();
        store
            .append(&session("a"), &labelled(false), "2026-01-01T00:00:00Z")
            .unwrap();
        store
            .append(&session("b"), &labelled(true), "2026-01-02T00:00:00Z")
            .unwrap();
        drop(store);
        let store = LabelStore::open(&path).unwrap();
        assert!(store.has(&session("a")).unwrap() && !store.has(&session("c")).unwrap());
        assert!(store.answers("strict", &[]).unwrap()["h/o/1"][0].yes);
        assert!(!store.answers("strict", &["a".into()]).unwrap()["h/o/1"][0].yes);
        assert!(store.answers("lenient", &[]).unwrap().is_empty());
    }

    #[test]
    fn a_session_is_stored_once_and_nothing_can_be_changed() {
        let folder = tempfile::tempdir().unwrap();
        let mut store = LabelStore::open(&folder.path().join("l.sqlite")).unwrap();
        store.append(&session("a"), &labelled(true), "t").unwrap();
        assert!(store.append(&session("a"), &labelled(true), "t").is_err());
        assert!(store.connection.execute("DELETE FROM event", []).is_err());
        assert!(
            store
                .connection
                .execute("UPDATE event_task SET answer = 'no'", [])
                .is_err()
        );
        assert_eq!(store.answers("strict", &[]).unwrap().len(), 1);
    }

    #[test]
    fn a_foreign_database_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.sqlite");
        Connection::open(&path)
            .unwrap()
            .execute_batch("CREATE TABLE t (a)")
            .unwrap();
        assert!(
            LabelStore::open(&path)
                .err()
                .unwrap()
                .to_string()
                .contains("another program")
        );
    }
}
