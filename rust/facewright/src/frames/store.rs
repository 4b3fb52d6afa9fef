//! Pictures and pyramids that were made, kept while there is room for them.
//!
//! Steps go over the frames in the same order again and again. To throw out what was used longest ago would throw out what
//! is needed next; so what was kept first stays, and what finds no room is made again whenever it is asked for.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

/// One kind of thing, at most one for each frame.
#[derive(Debug)]
pub struct Store<T> {
    kept: Vec<OnceLock<Arc<T>>>,
    room: AtomicUsize,
}

impl<T> Store<T> {
    /// Room for `bytes` in all.
    pub fn new(frames: usize, bytes: usize) -> Self {
        Self { kept: (0..frames).map(|_| OnceLock::new()).collect(), room: AtomicUsize::new(bytes) }
    }

    /// What is kept of a frame.
    pub fn get(&self, frame: usize) -> Option<Arc<T>> {
        self.kept[frame].get().cloned()
    }

    /// Keeps what was made of a frame, `bytes` large, if there is room; gives it back for use.
    pub fn keep(&self, frame: usize, made: T, bytes: usize) -> Arc<T> {
        let made = Arc::new(made);
        let take = |room: usize| room.checked_sub(bytes);
        if self.kept[frame].get().is_none()
            && self.room.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take).is_ok()
            && self.kept[frame].set(made.clone()).is_err()
        {
            // Another thread was first.
            self.room.fetch_add(bytes, Ordering::Relaxed);
        }
        made
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_stay_and_the_others_find_no_room() {
        let store = Store::new(3, 10);
        for frame in [1, 0, 2] {
            assert_eq!(*store.keep(frame, frame, 5), frame);
        }
        assert_eq!([0, 1, 2].map(|frame| store.get(frame).is_some()), [true, true, false]);
    }
}
