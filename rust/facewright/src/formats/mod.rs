//! The files that commands hand to each other, all JSON: read once, strictly, with a sentence for what is wrong.
//!
//! # Entry points
//! - [`Format`] is implemented by what a file holds; [`parse`] and [`read`] are its only readers.
//! - [`Schema`] is the first field of every file.

mod checks;
mod sentences;

pub(crate) use checks::{at_least_0, finite, once};

use crate::FacewrightError;
use crate::files::{json_text, write_text};
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;
use std::path::Path;

/// The version of the files' fields that this library writes; it reads all up to it.
const SCHEMA: u64 = 1;

/// The version of a file's fields; in files a whole number, which older files lack.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Schema;

impl Serialize for Schema {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u64(SCHEMA)
    }
}

impl<'de> Deserialize<'de> for Schema {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match u64::deserialize(deserializer)? {
            0..=SCHEMA => Ok(Self),
            newer => Err(D::Error::custom(format_args!("is {newer}, and this version knows up to {SCHEMA}"))),
        }
    }
}

/// What a file holds.
pub(crate) trait Format: Serialize + DeserializeOwned {
    /// What the file is usually called.
    const FILE: &'static str;
    /// What it holds, in the plural or uncountable.
    const HOLDS: &'static str;
    /// Without these keys it holds none.
    const KEYS: &'static [&'static str];

    /// What is wrong with the values.
    fn validate(&self) -> Result<(), String>;
}

/// Reads the text of a file.
pub(crate) fn parse<T: Format>(text: &str) -> Result<T, FacewrightError> {
    content(text).map_err(|reason| unreadable(Path::new(T::FILE), reason))
}

/// Reads a file.
pub(crate) fn read<T: Format>(path: &Path) -> Result<T, FacewrightError> {
    content(&text_of(path)?).map_err(|reason| unreadable(path, reason))
}

/// The text of a file.
pub(crate) fn text_of(path: &Path) -> Result<String, FacewrightError> {
    let bytes = std::fs::read(path).map_err(|e| unreadable(path, e.to_string()))?;
    if bytes.is_empty() {
        return Err(unreadable(path, "it is empty".to_owned()));
    }
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(unreadable(path, "it is text in UTF-16: save it as UTF-8".to_owned()));
    }
    String::from_utf8(bytes).map_err(|_| unreadable(path, "it is not a text file".to_owned()))
}

/// A text without the mark that editors of Windows put before it.
pub(crate) fn without_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

/// Writes a file, whole or not at all.
pub(crate) fn write<T: Format>(path: &Path, value: &T) -> Result<(), FacewrightError> {
    write_text(path, &json_text(value))
}

/// A text as a value that was checked, or what is wrong with it.
pub(crate) fn content<T: Format>(text: &str) -> Result<T, String> {
    let text = without_mark(text);
    // Only what cannot be read is parsed again, slowly, to say where.
    let value: T = serde_json::from_str(text).map_err(|_| complaint::<T>(text))?;
    value.validate()?;
    Ok(value)
}

/// Why a text cannot be read.
fn complaint<T: Format>(text: &str) -> String {
    let whole: Value = match serde_json::from_str(text) {
        Ok(whole) => whole,
        Err(error) => return format!("it is not JSON: {error}"),
    };
    if let Some(sentence) = too_new(&whole) {
        return sentence;
    }
    if T::KEYS.iter().any(|key| whole.get(key).is_none()) {
        return format!("it holds no {}", T::HOLDS);
    }
    match serde_path_to_error::deserialize::<_, T>(&mut serde_json::Deserializer::from_str(text)) {
        Ok(_) => "it goes on after its end".to_owned(),
        Err(error) => sentences::sentence(&whole, error.path(), &error.inner().to_string()),
    }
}

/// A part of a file that was read already.
pub(crate) fn from_value<T: DeserializeOwned>(whole: Value) -> Result<T, String> {
    let read = serde_path_to_error::deserialize(whole.clone());
    read.map_err(|error| sentences::sentence(&whole, error.path(), &error.inner().to_string()))
}

/// What to say of a file that a newer version wrote.
pub(crate) fn too_new(whole: &Value) -> Option<String> {
    let schema = whole.get("schema")?.as_u64().filter(|schema| *schema > SCHEMA)?;
    Some(format!("a newer Facewright wrote it (schema {schema}, this version knows up to {SCHEMA}): update Facewright"))
}

pub(crate) fn unreadable(path: &Path, reason: String) -> FacewrightError {
    FacewrightError::Read { path: path.to_owned(), reason }
}

/// For fields that older files have as `null`, or not at all.
pub(crate) fn null_is_default<'de, D, T>(deserializer: D) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: Default + Deserialize<'de>,
{
    Ok(Option::deserialize(deserializer)?.unwrap_or_default())
}
