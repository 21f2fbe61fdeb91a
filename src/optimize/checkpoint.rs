//! The file a run can be resumed from.

use super::atomic;
use super::identity::Identity;
use super::journal::{Answer, Journal, Record};
use super::limited::read_limited;
use crate::design::{AnalysisFailure, Evaluation};
use nalgebra::DMatrix;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// A journal with the name of what it belongs to.
///
/// The file is JSON. Every `f64` comes back bit for bit (infinities and NaN as the strings `"inf"`, `"-inf"`, `"nan"`;
/// NaN loses its payload).
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    /// All that the evaluations of the run and the optimiser's path depend on.
    pub identity: Identity,
    /// The evaluations of the run so far.
    pub journal: Journal,
}

/// A checkpoint that cannot be written or used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The file cannot be written.
    #[error("cannot write the checkpoint {}: {source}", path.display())]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The file cannot be read.
    #[error("cannot read the checkpoint {}: {source}", path.display())]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The file ends too early.
    #[error("the checkpoint {} is cut off; remove it and start anew", path.display())]
    Truncated {
        /// Path of the file.
        path: PathBuf,
    },
    /// The file is no checkpoint.
    #[error("{} is not a checkpoint ({reason}); remove it and start anew", path.display())]
    Malformed {
        /// Path of the file.
        path: PathBuf,
        /// The part that does not fit, in words.
        reason: String,
    },
    /// The file was written by another version.
    #[error("the checkpoint {} has format {found}, this program reads format {expected}; remove it and start anew", path.display())]
    Version {
        /// Path of the file.
        path: PathBuf,
        /// Format of the file.
        found: u64,
        /// Format that this program reads.
        expected: u64,
    },
    /// The file belongs to another run.
    #[error("the checkpoint {} belongs to another run: {}; choose another output directory or start anew", path.display(), changes.join("; "))]
    ForeignCase {
        /// Path of the file.
        path: PathBuf,
        /// The ways in which that run differs from the one asked for, in words.
        changes: Vec<String>,
    },
}

impl Checkpoint {
    /// Largest file that is read, in bytes. A run of 1000 evaluations of 20 000 variables stays below it.
    const MOST_BYTES: u64 = 4 << 30;

    /// The format that is written and read.
    pub const FORMAT: u64 = 2;

    /// Writes a checkpoint of the run `identity` to `path`, atomically: a crash leaves the old file or the new one.
    ///
    /// # Errors
    /// [`CheckpointError::Write`].
    pub fn save(path: &Path, identity: impl Into<Identity>, journal: &Journal) -> Result<(), CheckpointError> {
        let records = journal.records.iter().map(StoredRecord::from).collect();
        let stored = Stored { aeroform_checkpoint: Self::FORMAT, identity: identity.into(), records };
        atomic::stage(path, |file| serde_json::to_writer(file, &stored).map_err(io::Error::from))
            .and_then(|file| atomic::commit(file, path))
            .map_err(|source| CheckpointError::Write { path: path.to_owned(), source })
    }

    /// Reads the checkpoint of the run `identity` at `path`.
    ///
    /// # Errors
    /// Everything but [`CheckpointError::Write`].
    pub fn load(path: &Path, identity: impl Into<Identity>) -> Result<Self, CheckpointError> {
        let owned = || path.to_owned();
        let text =
            read_limited(path, Self::MOST_BYTES).map_err(|source| CheckpointError::Read { path: owned(), source })?;
        let malformed = |error: serde_json::Error| {
            // JSON cut inside of a number is a syntax error, not an early end
            let cut = text.starts_with(b"{") && !text.trim_ascii_end().ends_with(b"}");
            if error.is_eof() || cut {
                CheckpointError::Truncated { path: owned() }
            } else {
                CheckpointError::Malformed { path: owned(), reason: error.to_string() }
            }
        };
        let header: Header = serde_json::from_slice(&text).map_err(malformed)?;
        if header.aeroform_checkpoint != Self::FORMAT {
            let found = header.aeroform_checkpoint;
            return Err(CheckpointError::Version { path: owned(), found, expected: Self::FORMAT });
        }
        let owner: Owner = serde_json::from_slice(&text).map_err(malformed)?;
        let changes = owner.identity.changes(&identity.into());
        if !changes.is_empty() {
            return Err(CheckpointError::ForeignCase { path: owned(), changes });
        }
        let stored: Stored = serde_json::from_slice(&text).map_err(malformed)?;
        let records = stored.records.into_iter().map(Record::try_from).collect::<Result<_, _>>();
        let records =
            records.map_err(|reason: &str| CheckpointError::Malformed { path: owned(), reason: reason.into() })?;
        Ok(Self { identity: stored.identity, journal: Journal { records } })
    }
}

/// The part of a checkpoint that every version has.
#[derive(Deserialize)]
struct Header {
    aeroform_checkpoint: u64,
}

/// The part that tells whose checkpoint it is.
#[derive(Deserialize)]
struct Owner {
    identity: Identity,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    aeroform_checkpoint: u64,
    identity: Identity,
    records: Vec<StoredRecord>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredRecord {
    x: Vec<Number>,
    #[serde(flatten)]
    answer: StoredAnswer,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum StoredAnswer {
    Evaluation(StoredEvaluation),
    EvaluationFailed(String),
    /// The lower triangle by rows.
    Hessian(Vec<Number>),
    HessianFailed(String),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredEvaluation {
    objective: Number,
    gradient: Vec<Number>,
    constraints: Vec<Number>,
    jacobian: Vec<Vec<Number>>,
    values: Vec<Number>,
}

/// An `f64` that JSON can carry whatever it is.
#[derive(Clone, Copy)]
struct Number(f64);

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            v if v.is_finite() => serializer.serialize_f64(v),
            v if v.is_nan() => serializer.serialize_str("nan"),
            v if v > 0.0 => serializer.serialize_str("inf"),
            _ => serializer.serialize_str("-inf"),
        }
    }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = Number;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, \"nan\", \"inf\" or \"-inf\"")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<Number, E> {
                Ok(Number(v))
            }
            fn visit_u64<E: de::Error>(self, v: u64) -> Result<Number, E> {
                Ok(Number(v as f64))
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Number, E> {
                Ok(Number(v as f64))
            }
            fn visit_str<E: de::Error>(self, v: &str) -> Result<Number, E> {
                match v {
                    "nan" => Ok(Number(f64::NAN)),
                    "inf" => Ok(Number(f64::INFINITY)),
                    "-inf" => Ok(Number(f64::NEG_INFINITY)),
                    _ => Err(E::invalid_value(de::Unexpected::Str(v), &self)),
                }
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

fn pack(values: &[f64]) -> Vec<Number> {
    values.iter().copied().map(Number).collect()
}

fn unpack(values: &[Number]) -> Vec<f64> {
    values.iter().map(|v| v.0).collect()
}

impl From<&Record> for StoredRecord {
    fn from(record: &Record) -> Self {
        let answer = match &record.answer {
            Answer::Evaluation(Ok(e)) => StoredAnswer::Evaluation(StoredEvaluation {
                objective: Number(e.objective),
                gradient: pack(&e.gradient),
                constraints: pack(&e.constraints),
                jacobian: e.jacobian.iter().map(|row| pack(row)).collect(),
                values: pack(&e.values),
            }),
            Answer::Evaluation(Err(failure)) => StoredAnswer::EvaluationFailed(failure.reason.clone()),
            Answer::Hessian(Ok(matrix)) => {
                let lower = (0..matrix.nrows()).flat_map(|i| (0..=i).map(move |j| Number(matrix[(i, j)])));
                StoredAnswer::Hessian(lower.collect())
            }
            Answer::Hessian(Err(failure)) => StoredAnswer::HessianFailed(failure.reason.clone()),
        };
        Self { x: pack(&record.x), answer }
    }
}

impl TryFrom<StoredRecord> for Record {
    type Error = &'static str;

    fn try_from(stored: StoredRecord) -> Result<Self, &'static str> {
        let x = unpack(&stored.x);
        let answer = match stored.answer {
            StoredAnswer::Evaluation(e) => Answer::Evaluation(Ok(Evaluation {
                objective: e.objective.0,
                gradient: unpack(&e.gradient),
                constraints: unpack(&e.constraints),
                jacobian: e.jacobian.iter().map(|row| unpack(row)).collect(),
                values: unpack(&e.values),
            })),
            StoredAnswer::EvaluationFailed(reason) => Answer::Evaluation(Err(AnalysisFailure { reason })),
            StoredAnswer::Hessian(lower) => {
                let n = x.len();
                if lower.len() != n * (n + 1) / 2 {
                    return Err("a Hessian of the wrong size");
                }
                let entry = |i: usize, j: usize| lower[i * (i + 1) / 2 + j].0;
                Answer::Hessian(Ok(DMatrix::from_fn(n, n, |i, j| entry(i.max(j), i.min(j)))))
            }
            StoredAnswer::HessianFailed(reason) => Answer::Hessian(Err(AnalysisFailure { reason })),
        };
        Ok(Self { x, answer })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn journal() -> Journal {
        let values =
            vec![0.1, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 5e-324, f64::MAX, 1.0 / 3.0, 3.0, 1e300];
        let evaluation = Evaluation {
            objective: 0.1 + 0.2,
            gradient: vec![2.0_f64.powi(-1074), 4e-7 / 3.0],
            constraints: vec![1.0],
            jacobian: vec![vec![-1.0, 1e-17]],
            values,
        };
        let failure = AnalysisFailure { reason: "no \"solution\"".into() };
        let hessian = DMatrix::from_row_slice(2, 2, &[1.0, 0.3, 0.3, f64::EPSILON]);
        let answers = [
            Answer::Evaluation(Ok(evaluation)),
            Answer::Evaluation(Err(failure.clone())),
            Answer::Hessian(Ok(hessian)),
            Answer::Hessian(Err(failure)),
        ];
        Journal { records: answers.map(|answer| Record { x: vec![1.0 / 3.0, -0.0], answer }).into() }
    }

    fn saved() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint.json");
        Checkpoint::save(&path, "mine", &journal()).unwrap();
        (folder, path)
    }

    #[test]
    fn round_trip_is_exact() {
        let (_folder, path) = saved();
        let loaded = Checkpoint::load(&path, "mine").unwrap().journal;
        // Debug tells -0 from 0, and NaN is NaN
        assert_eq!(format!("{loaded:?}"), format!("{:?}", journal()));
        let mut seed = 1_u64;
        let x: Vec<f64> = std::iter::repeat_with(|| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            f64::from_bits(seed)
        })
        .filter(|v| v.is_finite())
        .take(10_000)
        .collect();
        let answer = Answer::Evaluation(Err(AnalysisFailure { reason: String::new() }));
        let journal = Journal { records: vec![Record { x, answer }] };
        Checkpoint::save(&path, "mine", &journal).unwrap();
        assert_eq!(Checkpoint::load(&path, "mine").unwrap().journal, journal);
    }

    #[test]
    fn every_cut_is_an_error() {
        let (_folder, path) = saved();
        let text = std::fs::read(&path).unwrap();
        for length in 0..text.len() {
            std::fs::write(&path, &text[..length]).unwrap();
            let error = Checkpoint::load(&path, "mine").unwrap_err();
            assert!(matches!(error, CheckpointError::Truncated { .. }), "{length}: {error}");
        }
    }

    #[test]
    fn foreign_files_are_errors() {
        let (folder, path) = saved();
        let error = Checkpoint::load(&path, "yours").unwrap_err();
        assert!(
            matches!(&error, CheckpointError::ForeignCase { changes, .. } if *changes == ["run was mine, is yours"]),
            "{error}"
        );
        assert!(matches!(Checkpoint::load(&folder.path().join("none"), "mine"), Err(CheckpointError::Read { .. })));
        let attempt = |text: &str| {
            std::fs::write(&path, text).unwrap();
            Checkpoint::load(&path, "mine").unwrap_err()
        };
        let later = r#"{"aeroform_checkpoint":3,"identity":"of another kind","something":{"new":[1]}}"#;
        assert!(matches!(attempt(later), CheckpointError::Version { found: 3, expected: 2, .. }));
        for text in [
            "not JSON",
            r#"{"objective":1}"#,
            r#"{"aeroform_checkpoint":2,"identity":[["run","mine"]],"records":[{"x":[1,"what"],"evaluation_failed":""}]}"#,
            r#"{"aeroform_checkpoint":2,"identity":[["run","mine"]],"records":[{"x":[1,2],"hessian":[1,2]}]}"#,
            r#"{"aeroform_checkpoint":2,"identity":[["run","mine"]],"records":[{"x":[1]}]}"#,
        ] {
            let error = attempt(text);
            assert!(matches!(error, CheckpointError::Malformed { .. }), "{text}: {error}");
        }
    }
}
