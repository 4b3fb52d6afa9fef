//! `matches.json`: read, checked and written.

use super::{MatchedPair, Matches};
use crate::FacewrightError;
use crate::formats::{self, Format, finite};
use std::path::Path;

impl Matches {
    /// Reads a `matches.json`.
    ///
    /// # Errors
    /// [`FacewrightError::Read`] where it is none, or what it says cannot be.
    pub fn read(path: &Path) -> Result<Self, FacewrightError> {
        formats::read(path)
    }

    /// Reads the text of a `matches.json`; errors as those of [`Matches::read`].
    pub fn parse(text: &str) -> Result<Self, FacewrightError> {
        formats::parse(text)
    }

    /// Writes a `matches.json`, whole or not at all.
    ///
    /// # Errors
    /// [`FacewrightError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), FacewrightError> {
        formats::write(path, self)
    }
}

impl Format for Matches {
    const FILE: &'static str = "matches.json";
    const HOLDS: &'static str = "matches";
    const KEYS: &'static [&'static str] = &["pairs"];

    fn validate(&self) -> Result<(), String> {
        self.pairs.iter().try_for_each(MatchedPair::validate)
    }
}

impl MatchedPair {
    fn validate(&self) -> Result<(), String> {
        let (pair, count) = (format!("{} and {}", self.a, self.b), self.points.len());
        for (list, own) in [("tracked", self.tracked.len()), ("outcomes", self.outcomes.len())] {
            if own != count {
                return Err(format!("{pair} have {count} points and {own} {list}"));
            }
        }
        for (number, &(ua, va, ub, vb, kept)) in self.points.iter().enumerate() {
            finite(&[ua, va, ub, vb], || format!("match {number} of {pair}"))?;
            if kept > 1 {
                return Err(format!("match {number} of {pair} is marked {kept}, not 1 (kept) or 0"));
            }
        }
        let tracked = self.tracked.iter().flatten();
        tracked.enumerate().try_for_each(|(_, at)| finite(at, || format!("a tracked place of {pair}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Schema;

    fn matches() -> Matches {
        let pair = MatchedPair {
            a: "f1".to_owned(),
            b: "f2".to_owned(),
            points: vec![(1.0, 2.0, 3.25, 4.0, 1), (5.0, 6.0, 7.0, 8.0, 0)],
            tracked: vec![Some([3.5, 4.0]), None],
            outcomes: vec!["kept".to_owned(), "rejected: no match".to_owned()],
            violations_before: 2,
            violations_after: 0,
        };
        Matches { schema: Schema, pairs: vec![pair] }
    }

    #[test]
    fn what_was_written_is_read_again_and_older_files_too() {
        let text = serde_json::to_string(&matches()).unwrap();
        assert!(text.starts_with(r#"{"schema":1,"pairs""#), "{text}");
        assert_eq!(Matches::parse(&text).unwrap(), matches());
        assert_eq!(Matches::parse(&text.replace(r#""schema":1,"#, "")).unwrap(), matches());
    }

    #[test]
    fn what_cannot_be_is_told_in_words() {
        let told = |change: fn(&mut MatchedPair)| {
            let mut broken = matches();
            change(&mut broken.pairs[0]);
            Matches::parse(&serde_json::to_string(&broken).unwrap()).unwrap_err().to_string()
        };
        assert!(told(|pair| pair.tracked.truncate(1)).contains("f1 and f2 have 2 points and 1 tracked"));
        assert!(told(|pair| pair.outcomes.truncate(1)).contains("f1 and f2 have 2 points and 1 outcomes"));
        assert!(told(|pair| pair.points[1].4 = 2).contains("match 1 of f1 and f2 is marked 2"));
        let none = Matches::parse("{}").unwrap_err().to_string();
        assert!(none.contains("matches.json cannot be read: it holds no matches"), "{none}");
    }
}
