//! The shape of the head: by ours ([`shape`]) and by the paper's way ([`paper`]).

pub mod paper;
pub mod shape;
pub mod unseen;
