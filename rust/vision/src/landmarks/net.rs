//! One neural net: square RGB crop in, lists of numbers out.
//!
//! All nets share one pool of threads. A caller's own rayon worker must not wait inside that pool, because a waiting
//! worker picks up other work (more frames, each with its own buffers): [`Threads::run`] waits on a plain thread.

use super::LandmarkError;
use rten::{Model, ModelOptions, NodeId, RunOptions, ThreadPool};
use rten_tensor::{NdTensorView, Tensor, prelude::*};
use std::path::Path;
use std::sync::Arc;

/// The pool all nets run on.
#[derive(Clone)]
pub struct Threads(Arc<ThreadPool>);

impl Threads {
    /// As many threads as the machine offers, or as given. The numbers the nets give do not depend on it.
    pub fn new(count: Option<usize>) -> Self {
        let offered = || std::thread::available_parallelism().map_or(1, usize::from);
        Self(Arc::new(ThreadPool::with_num_threads(count.unwrap_or_else(offered))))
    }

    /// Runs `work` on the pool, where `rayon::join` and the nets share its threads.
    pub fn run<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        std::thread::scope(|scope| match scope.spawn(|| self.0.run(work)).join() {
            Ok(result) => result,
            Err(cause) => std::panic::resume_unwind(cause),
        })
    }
}

/// A loaded net with one picture input and `N` outputs.
pub struct Net<const N: usize> {
    name: &'static str,
    model: Model,
    input: NodeId,
    outputs: [NodeId; N],
    side: usize,
    options: RunOptions,
}

impl<const N: usize> Net<N> {
    /// Loads `<folder>/<name>.onnx`, a net for crops of `side` × `side` pixels.
    pub fn load(folder: &Path, name: &'static str, side: usize, threads: &Threads) -> Result<Self, LandmarkError> {
        let path = folder.join(format!("{name}.onnx"));
        if !path.is_file() {
            return Err(LandmarkError::NetMissing { path });
        }
        let unusable = |reason: String| LandmarkError::NetUnusable { path: path.clone(), reason };
        let mut options = ModelOptions::with_all_ops();
        options.prepack_weights(true);
        let model = options.load_file(&path).map_err(|e| unusable(e.to_string()))?;
        let &[input] = model.input_ids() else { return Err(unusable("it has not one input".into())) };
        let outputs = <[NodeId; N]>::try_from(model.output_ids())
            .map_err(|_| unusable(format!("it has {} outputs, not {N}", model.output_ids().len())))?;
        let options = RunOptions::default().with_thread_pool(Some(threads.0.clone()));
        Ok(Self { name, model, input, outputs, side, options })
    }

    /// Width and height of the crop.
    pub fn side(&self) -> usize {
        self.side
    }

    /// Runs the net on a crop (three planes red, green, blue, each row by row).
    pub fn run(&self, planes: &[f32]) -> Result<[Vec<f32>; N], LandmarkError> {
        let failed = |reason: String| LandmarkError::NetFailed { net: self.name, reason };
        let shape = [1, 3, self.side, self.side];
        let input = NdTensorView::try_from_data(shape, planes).map_err(|e| failed(e.to_string()))?;
        let results = self
            .model
            .run_n(vec![(self.input, input.into())], self.outputs, Some(self.options.clone()))
            .map_err(|e| failed(e.to_string()))?;
        let mut lists = std::array::from_fn(|_| Vec::new());
        for (list, result) in lists.iter_mut().zip(results) {
            *list = Tensor::<f32>::try_from(result).map_err(|e| failed(e.to_string()))?.to_vec();
        }
        Ok(lists)
    }

    /// Complains about an output of unexpected length.
    pub fn expect_length(&self, list: &[f32], length: usize) -> Result<(), LandmarkError> {
        if list.len() == length {
            return Ok(());
        }
        Err(LandmarkError::NetFailed {
            net: self.name,
            reason: format!("it gave {} numbers, not {length}", list.len()),
        })
    }
}
