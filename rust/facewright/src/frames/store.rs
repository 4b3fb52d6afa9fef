//! Pictures and pyramids that were made, kept while there is room for them.
//!
//! Steps go over the frames in the same order again and again. To throw out what was used longest ago would throw out what
//! is needed next; so what was kept first stays, and what finds no room is made again whenever it is asked for.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What was made of a frame.
#[derive(Debug)]
struct Kept<T> {
    made: Arc<T>,
    bytes: usize,
}

/// One kind of thing, at most one for each frame.
#[derive(Debug)]
pub struct Store<T> {
    kept: Vec<Mutex<Option<Kept<T>>>>,
    /// Bytes in all.
    capacity: usize,
    room: AtomicUsize,
}

impl<T> Store<T> {
    /// Room for `bytes` in all.
    pub fn new(frames: usize, bytes: usize) -> Self {
        Self { kept: (0..frames).map(|_| Mutex::new(None)).collect(), capacity: bytes, room: AtomicUsize::new(bytes) }
    }

    fn at(&self, frame: usize) -> MutexGuard<'_, Option<Kept<T>>> {
        // Nothing panics between two states.
        self.kept[frame].lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What is kept of a frame.
    pub fn get(&self, frame: usize) -> Option<Arc<T>> {
        self.at(frame).as_ref().map(|kept| kept.made.clone())
    }

    /// Keeps what was made of a frame, `bytes` large, instead of what was kept of it, if there is room; gives it back for use.
    pub fn keep(&self, frame: usize, made: T, bytes: usize) -> Arc<T> {
        let (mut kept, made) = (self.at(frame), Arc::new(made));
        let before = kept.take().map_or(0, |before| before.bytes);
        let take = |room: usize| (room + before).checked_sub(bytes);
        if self.room.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take).is_ok() {
            *kept = Some(Kept { made: made.clone(), bytes });
        } else {
            self.room.fetch_add(before, Ordering::Relaxed);
        }
        made
    }

    /// Lets go of everything that nobody uses; there is room again.
    pub fn clear(&self) {
        (0..self.kept.len()).for_each(|frame| *self.at(frame) = None);
        self.room.store(self.capacity, Ordering::Relaxed);
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
        store.clear();
        store.keep(2, 7, 6);
        store.keep(2, 8, 10);
        assert_eq!((store.get(0), store.get(2)), (None, Some(Arc::new(8))));
    }
}
