//! Progress on standard error.

use geometry::Progress;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// A thread that shows a job's progress.
pub(super) struct Watch {
    done: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Watch {
    /// Begins to watch.
    pub fn start(progress: &Progress, visible: bool) -> Self {
        let done = Arc::new(AtomicBool::new(false));
        let (watched, ended) = (progress.clone(), done.clone());
        let thread = std::thread::spawn(move || show(&watched, &ended, visible));
        Self { done, thread }
    }

    /// Ends the display.
    pub fn stop(self) {
        self.done.store(true, Ordering::Relaxed);
        // A display that panicked has nothing more to show.
        let _ = self.thread.join();
    }
}

fn show(progress: &Progress, done: &AtomicBool, visible: bool) {
    let target = if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(1000), target);
    if let Ok(style) = ProgressStyle::with_template("{elapsed:>4} {prefix:<16} {bar:40} {msg}") {
        bar.set_style(style);
    }
    while !done.load(Ordering::Relaxed) {
        let shown = progress.snapshot();
        let step = shown.step.map_or(String::new(), |(number, all)| format!("{number}/{all} "));
        bar.set_prefix(step + &shown.stage);
        bar.set_message(shown.remaining_s.map_or(String::new(), time_left));
        bar.set_position((shown.fraction * 1000.0) as u64);
        std::thread::sleep(Duration::from_millis(50));
    }
    bar.finish_and_clear();
}

fn time_left(seconds: f64) -> String {
    format!("{} left", HumanDuration(Duration::from_secs(seconds.ceil() as u64)))
}
