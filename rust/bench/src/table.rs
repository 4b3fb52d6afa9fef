//! Ours beside the peers'.

use crate::feature::Figure;
use std::io::Write;

/// A judged run.
pub struct Judged {
    /// Name and version of the side.
    pub program: String,
    /// Which input.
    pub case: String,
    /// What was done.
    pub task: String,
    /// How.
    pub setting: String,
    /// How well.
    pub figures: Vec<Figure>,
}

/// Prints a line per figure and peer. The ratio is above 1 where ours is faster, more exact or more complete.
///
/// Another way of ours, one with a setting, stands among the peers.
pub fn print(judged: &[Judged]) -> anyhow::Result<()> {
    let mut rows = vec![["what", "ours", "peer", "peer's", "ratio"].map(str::to_owned)];
    let is_ours = |run: &&Judged| run.program.starts_with("Facewright") && run.setting.is_empty();
    for ours in judged.iter().filter(is_ours) {
        let peers = judged.iter().filter(|run| !is_ours(run) && run.case == ours.case && run.task == ours.task);
        let peers: Vec<&Judged> = peers.collect();
        for figure in &ours.figures {
            rows.extend(peers.iter().filter_map(|peer| row(ours, figure, peer)));
        }
    }
    blank_repeated(&mut rows);
    write_columns(&rows)
}

fn row(ours: &Judged, figure: &Figure, peer: &Judged) -> Option<[String; 5]> {
    let other = peer.figures.iter().find(|f| f.what == figure.what)?;
    let what = format!("{}: {}, {}", ours.case, ours.task, figure.what);
    let name = format!("{} {}", peer.program, peer.setting);
    let ratio = if figure.more_is_better { figure.value / other.value } else { other.value / figure.value };
    Some([what, number(figure.value), name.trim().to_owned(), number(other.value), number(ratio)])
}

/// What stands above need not be said again.
fn blank_repeated(rows: &mut [[String; 5]]) {
    for k in (1..rows.len()).rev() {
        if rows[k][0] == rows[k - 1][0] {
            rows[k][..2].fill(String::new());
        }
    }
}

/// Three significant digits, or all of a larger whole number.
fn number(value: f64) -> String {
    if !value.is_finite() {
        return "-".to_owned();
    }
    let digits = if value == 0.0 { 0 } else { 2 - value.abs().log10().floor() as i32 };
    format!("{value:.*}", digits.max(0) as usize)
}

fn write_columns(rows: &[[String; 5]]) -> anyhow::Result<()> {
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let [what, ours, peer, theirs, ratio] = [0, 1, 2, 3, 4].map(width);
    let mut out = std::io::stdout().lock();
    for row in rows {
        let [a, b, c, d, e] = row;
        writeln!(out, "{a:<what$}  {b:>ours$}  {c:<peer$}  {d:>theirs$}  {e:>ratio$}")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        for (value, text) in [(0.01234, "0.0123"), (1.0, "1.00"), (98.76, "98.8"), (1234.5, "1234"), (f64::NAN, "-")] {
            assert_eq!(number(value), text);
        }
    }
}
