//! What serde says of a value that it could not read, as a sentence about that value.

use serde_json::Value;
use serde_path_to_error::{Path, Segment};

/// What the things in a list are called, and the key that tells them apart.
const LISTS: [(&str, &str, &str); 6] = [
    ("frames", "frame", "name"),
    ("tracks", "track", "id"),
    ("points", "point", "id"),
    ("images", "picture", "name"),
    ("cameras", "camera", "name"),
    ("boards", "board", ""),
];

/// A value that something is wrong with.
struct Subject {
    /// The thing in a list that it belongs to: `track 7`.
    owner: Option<String>,
    /// Its key there, and what is below.
    key: String,
}

impl Subject {
    fn of(whole: &Value, path: &Path) -> Self {
        let (mut owner, mut key, mut here) = (None, String::new(), Some(whole));
        for segment in path {
            match segment {
                Segment::Map { key: next } => {
                    here = here.and_then(|value| value.get(next));
                    let dot = if key.is_empty() { "" } else { "." };
                    key = format!("{key}{dot}{next}");
                }
                Segment::Seq { index } => {
                    here = here.and_then(|value| value.get(index));
                    match LISTS.iter().find(|(list, ..)| owner.is_none() && *list == key) {
                        Some((_, noun, name)) => {
                            owner = Some(label(noun, *index, here.and_then(|value| value.get(name))));
                            key.clear();
                        }
                        None => key = format!("{key}[{index}]"),
                    }
                }
                _ => {}
            }
        }
        Self { owner, key }
    }

    fn name(&self) -> String {
        match (&self.owner, self.key.as_str()) {
            (None, "") => "it".to_owned(),
            (None, key) => format!("its {key}"),
            (Some(owner), "") => owner.clone(),
            (Some(owner), key) => format!("the {key} of {owner}"),
        }
    }
}

/// A thing by its name or number, or by its place in the list.
fn label(noun: &str, index: usize, name: Option<&Value>) -> String {
    match name {
        Some(Value::String(name)) => format!("{noun} {name}"),
        Some(Value::Number(id)) => format!("{noun} {id}"),
        _ => format!("{noun} number {index}"),
    }
}

/// The sentence for serde's `message` about the value at a path.
pub(super) fn sentence(whole: &Value, path: &Path, message: &str) -> String {
    let message = message.rsplit_once(" at line ").map_or(message, |(before, _)| before);
    let subject = Subject::of(whole, path).name();
    if let Some(field) = message.strip_prefix("missing field ") {
        return format!("{subject} has no {}", bare(field));
    }
    let Some((found, wanted)) = message.split_once(", expected ") else {
        let verb = if message.starts_with("is ") { " " } else { ": " };
        return format!("{subject}{verb}{message}");
    };
    let wanted = wanted_words(wanted);
    if let Some(length) = found.strip_prefix("invalid length ") {
        return format!("{subject} has {length} values, not {}", wanted.trim_end_matches(" values"));
    }
    let found = ["invalid type: ", "invalid value: ", "unknown variant "]
        .iter()
        .find_map(|kind| found.strip_prefix(kind))
        .unwrap_or(found);
    let found = match found {
        "map" => "an object".to_owned(),
        "sequence" => "a list".to_owned(),
        other => bare(other),
    };
    format!("{subject} is {found}, not {wanted}")
}

/// What serde expected, in words.
fn wanted_words(wanted: &str) -> String {
    let values = ["a tuple of size ", "an array of length "].iter().find_map(|kind| wanted.strip_prefix(kind));
    match wanted {
        _ if values.is_some() => format!("{} values", values.unwrap_or_default()),
        "f64" | "f32" => "a number".to_owned(),
        "usize" | "u64" | "u32" => "a whole number from 0 on".to_owned(),
        "a sequence" => "a list".to_owned(),
        other if other.starts_with("struct ") => "an object".to_owned(),
        other => bare(other),
    }
}

fn bare(text: &str) -> String {
    text.replace('`', "")
}
