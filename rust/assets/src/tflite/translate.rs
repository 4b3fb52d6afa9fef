//! Rewrites a TensorFlow Lite graph as an ONNX graph, channels last to channels first.

use super::TfliteError;
use super::onnx::{Attribute, Graph};
use super::schema::{Activation, Constant, Kind, Model, Operator, Padding, Window};

/// Axes of ONNX pictures in terms of TensorFlow Lite pictures, and back.
const CHANNELS_FIRST: [usize; 4] = [0, 3, 1, 2];
const CHANNELS_LAST: [usize; 4] = [0, 2, 3, 1];

/// The ONNX file of a net.
pub fn to_onnx(model: &Model) -> Result<Vec<u8>, TfliteError> {
    let constants = model.tensors.iter().map(|t| t.constant.clone()).collect();
    let mut translation = Translation { model, constants, graph: Graph::default() };
    for &input in &model.inputs {
        translation.graph.input(&name(input), &translation.onnx_shape(input));
    }
    for (position, operator) in model.operators.iter().enumerate() {
        Step { position, operator }.translate(&mut translation)?;
    }
    for &output in &model.outputs {
        translation.graph.output(&name(output), &translation.onnx_shape(output));
    }
    Ok(translation.graph.into_file())
}

/// The ONNX name of a tensor.
fn name(tensor: usize) -> String {
    format!("t{tensor}")
}

/// `values` of `shape` with its axes in another order.
fn permute(values: &[f32], shape: &[usize], order: &[usize]) -> (Vec<usize>, Vec<f32>) {
    let stride = |axis: usize| shape[axis + 1..].iter().product::<usize>();
    let permuted: Vec<usize> = order.iter().map(|&axis| shape[axis]).collect();
    let strides: Vec<usize> = order.iter().map(|&axis| stride(axis)).collect();
    let source = |mut position: usize| {
        (0..permuted.len()).rev().fold(0, |from, axis| {
            let index = position % permuted[axis];
            position /= permuted[axis];
            from + index * strides[axis]
        })
    };
    let moved = (0..values.len()).map(|position| values[source(position)]).collect();
    (permuted, moved)
}

/// Zeros before and after one axis so that windows give `output` results.
fn same_padding(input: usize, output: usize, kernel: usize, stride: usize, dilation: usize) -> (usize, usize) {
    let reach = (output.saturating_sub(1)) * stride + (kernel.saturating_sub(1)) * dilation + 1;
    let total = reach.saturating_sub(input);
    (total / 2, total - total / 2)
}

/// The graph as far as it is translated.
struct Translation<'a> {
    model: &'a Model,
    /// Known values, among them those of folded operators, by tensor.
    constants: Vec<Option<Constant>>,
    graph: Graph,
}

impl Translation<'_> {
    fn shape(&self, tensor: usize) -> &[usize] {
        &self.model.tensors[tensor].shape
    }

    fn onnx_shape(&self, tensor: usize) -> Vec<usize> {
        match self.shape(tensor) {
            &[n, h, w, c] => vec![n, c, h, w],
            other => other.to_vec(),
        }
    }

    fn floats(&self, tensor: usize) -> Option<&[f32]> {
        match &self.constants[tensor] {
            Some(Constant::Floats(values)) => Some(values),
            _ => None,
        }
    }

    fn ints(&self, tensor: usize) -> Option<&[i32]> {
        match &self.constants[tensor] {
            Some(Constant::Ints(values)) => Some(values),
            _ => None,
        }
    }
}

/// One operator of the net and its place.
struct Step<'a> {
    position: usize,
    operator: &'a Operator,
}

impl Step<'_> {
    fn bad(&self, what: &'static str) -> TfliteError {
        TfliteError::BadOperator { operator: self.position, what }
    }

    fn input(&self, k: usize) -> Result<usize, TfliteError> {
        self.operator.inputs.get(k).copied().flatten().ok_or(self.bad("input"))
    }

    fn output(&self) -> Result<usize, TfliteError> {
        self.operator.outputs.first().copied().ok_or(self.bad("output"))
    }

    /// Name of a value that only this operator knows.
    fn local(&self, what: &str) -> String {
        format!("o{}_{what}", self.position)
    }

    fn translate(&self, to: &mut Translation) -> Result<(), TfliteError> {
        match self.operator.kind {
            Kind::Add(activation) => self.of_two(to, "Add", activation),
            Kind::AveragePool2d(window, filter, activation) => self.pool(to, "AveragePool", window, filter, activation),
            Kind::Concatenation(axis, activation) => self.concatenation(to, axis, activation),
            Kind::Conv2d(window, activation) => self.convolution(to, window, activation, false),
            Kind::DepthwiseConv2d(window, activation) => self.convolution(to, window, activation, true),
            Kind::Dequantize => self.dequantize(to),
            Kind::HardSwish => self.simple(to, "HardSwish"),
            Kind::Logistic => self.simple(to, "Sigmoid"),
            Kind::MaxPool2d(window, filter, activation) => self.pool(to, "MaxPool", window, filter, activation),
            Kind::Mul(activation) => self.of_two(to, "Mul", activation),
            Kind::Pad => self.pad(to),
            Kind::Prelu => self.prelu(to),
            Kind::Relu => self.simple(to, "Relu"),
            Kind::Reshape => self.reshape(to),
            Kind::ResizeBilinear { align_corners, half_pixel_centers } => {
                self.resize(to, align_corners, half_pixel_centers)
            }
            Kind::TransposeConv2d(window) => self.transposed_convolution(to, window),
        }
    }

    /// Adds the operator's node, then the fused activation.
    fn emit(
        &self,
        to: &mut Translation,
        operator: &str,
        inputs: &[&str],
        attributes: &[Attribute],
        activation: Activation,
    ) -> Result<(), TfliteError> {
        let output = name(self.output()?);
        match activation {
            Activation::None => to.graph.node(operator, inputs, &output, attributes),
            Activation::Relu => {
                let linear = self.local("linear");
                to.graph.node(operator, inputs, &linear, attributes);
                to.graph.node("Relu", &[&linear], &output, &[]);
            }
        }
        Ok(())
    }

    fn simple(&self, to: &mut Translation, operator: &str) -> Result<(), TfliteError> {
        self.emit(to, operator, &[&name(self.input(0)?)], &[], Activation::None)
    }

    /// Writes a stored operand so that it broadcasts against channels-first pictures, and gives its name.
    fn operand(&self, to: &mut Translation, k: usize) -> Result<String, TfliteError> {
        let tensor = self.input(k)?;
        let Some(values) = to.floats(tensor) else { return Ok(name(tensor)) };
        let mut shape = to.shape(tensor).to_vec();
        while shape.len() < 4 {
            shape.insert(0, 1);
        }
        let (shape, values) = permute(values, &shape, &CHANNELS_FIRST);
        let stored = self.local(&format!("operand{k}"));
        to.graph.floats(&stored, &shape, &values);
        Ok(stored)
    }

    fn of_two(&self, to: &mut Translation, operator: &str, activation: Activation) -> Result<(), TfliteError> {
        let (left, right) = (self.operand(to, 0)?, self.operand(to, 1)?);
        self.emit(to, operator, &[&left, &right], &[], activation)
    }

    fn prelu(&self, to: &mut Translation) -> Result<(), TfliteError> {
        let (input, slope) = (name(self.input(0)?), self.operand(to, 1)?);
        self.emit(to, "PRelu", &[&input, &slope], &[], Activation::None)
    }

    fn concatenation(&self, to: &mut Translation, axis: i32, activation: Activation) -> Result<(), TfliteError> {
        let rank = to.shape(self.output()?).len();
        let axis = if axis < 0 { rank as i32 + axis } else { axis };
        let axis = usize::try_from(axis).ok().filter(|&a| a < rank).ok_or(self.bad("axis"))?;
        let axis = if rank == 4 { CHANNELS_LAST[axis] } else { axis };
        let inputs = (0..self.operator.inputs.len())
            .map(|k| Ok(name(self.input(k)?)))
            .collect::<Result<Vec<_>, TfliteError>>()?;
        let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
        self.emit(to, "Concat", &inputs, &[Attribute::Int("axis", axis as i64)], activation)
    }

    fn dequantize(&self, to: &mut Translation) -> Result<(), TfliteError> {
        let widened = to.constants[self.input(0)?].clone().ok_or(self.bad("stored half precision input"))?;
        to.constants[self.output()?] = Some(widened);
        Ok(())
    }

    /// The attributes of a window of `kernel` taps over this operator's input.
    fn window(
        &self,
        to: &Translation,
        window: Window,
        kernel: [usize; 2],
    ) -> Result<Vec<Attribute<'static>>, TfliteError> {
        let (&[_, h, w, _], &[_, h_out, w_out, _]) = (to.shape(self.input(0)?), to.shape(self.output()?)) else {
            return Err(self.bad("picture"));
        };
        let ((top, bottom), (left, right)) = match window.padding {
            Padding::Valid => ((0, 0), (0, 0)),
            Padding::Same => (
                same_padding(h, h_out, kernel[0], window.stride[0], window.dilation[0]),
                same_padding(w, w_out, kernel[1], window.stride[1], window.dilation[1]),
            ),
        };
        let list = |numbers: &[usize]| numbers.iter().map(|&n| n as i64).collect::<Vec<_>>();
        Ok(vec![
            Attribute::Ints("kernel_shape", list(&kernel)),
            Attribute::Ints("strides", list(&window.stride)),
            Attribute::Ints("dilations", list(&window.dilation)),
            Attribute::Ints("pads", list(&[top, left, bottom, right])),
        ])
    }

    /// Names of a convolution's input, its weights and, where it has one, its bias, which are stored.
    fn weighted(&self, to: &mut Translation, shape: &[usize], values: &[f32]) -> Result<Vec<String>, TfliteError> {
        let mut inputs = vec![name(self.input(0)?), self.local("weights")];
        to.graph.floats(&inputs[1], shape, values);
        if let Some(&Some(bias)) = self.operator.inputs.get(2) {
            let values = to.floats(bias).ok_or(self.bad("bias"))?.to_vec();
            inputs.push(self.local("bias"));
            to.graph.floats(&inputs[2], &[values.len()], &values);
        }
        Ok(inputs)
    }

    fn convolution(
        &self,
        to: &mut Translation,
        window: Window,
        activation: Activation,
        depthwise: bool,
    ) -> Result<(), TfliteError> {
        let (input, weights) = (self.input(0)?, self.input(1)?);
        let &[_, rows, columns, _] = to.shape(weights) else { return Err(self.bad("weights")) };
        let order = if depthwise { [3, 0, 1, 2] } else { CHANNELS_FIRST };
        let values = to.floats(weights).ok_or(self.bad("weights"))?;
        let (shape, values) = permute(values, to.shape(weights), &order);
        let mut attributes = self.window(to, window, [rows, columns])?;
        if depthwise {
            let channels = to.shape(input)[3];
            attributes.push(Attribute::Int("group", channels as i64));
        }
        let inputs = self.weighted(to, &shape, &values)?;
        let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
        self.emit(to, "Conv", &inputs, &attributes, activation)
    }

    /// What the result would reach beyond the size it has is cut off its sides, as TensorFlow does with either padding.
    fn transposed_convolution(&self, to: &mut Translation, window: Window) -> Result<(), TfliteError> {
        let (input, weights) = (self.input(0)?, self.input(1)?);
        let (&[_, h, w, _], &[_, h_out, w_out, _]) = (to.shape(input), to.shape(self.output()?)) else {
            return Err(self.bad("picture"));
        };
        let &[_, rows, columns, _] = to.shape(weights) else { return Err(self.bad("weights")) };
        let values = to.floats(weights).ok_or(self.bad("weights"))?;
        let (shape, values) = permute(values, to.shape(weights), &[3, 0, 1, 2]);
        let cut = |input: usize, output: usize, kernel: usize, stride: usize| {
            let (before, after) = same_padding(output, input, kernel, stride, 1);
            let is_whole = input.saturating_sub(1) * stride + kernel == output + before + after;
            is_whole.then_some((before, after)).ok_or(self.bad("size of the result"))
        };
        let (top, bottom) = cut(h, h_out, rows, window.stride[0])?;
        let (left, right) = cut(w, w_out, columns, window.stride[1])?;
        let list = |numbers: &[usize]| numbers.iter().map(|&n| n as i64).collect::<Vec<_>>();
        let attributes = [
            Attribute::Ints("kernel_shape", list(&[rows, columns])),
            Attribute::Ints("strides", list(&window.stride)),
            Attribute::Ints("pads", list(&[top, left, bottom, right])),
        ];
        let inputs = self.weighted(to, &shape, &values)?;
        let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
        self.emit(to, "ConvTranspose", &inputs, &attributes, Activation::None)
    }

    fn pool(
        &self,
        to: &mut Translation,
        operator: &str,
        window: Window,
        filter: [usize; 2],
        activation: Activation,
    ) -> Result<(), TfliteError> {
        let attributes = self.window(to, window, filter)?;
        self.emit(to, operator, &[&name(self.input(0)?)], &attributes, activation)
    }

    fn pad(&self, to: &mut Translation) -> Result<(), TfliteError> {
        let amounts = to.ints(self.input(1)?).ok_or(self.bad("stored paddings"))?;
        let rank = to.shape(self.input(0)?).len();
        if amounts.len() != 2 * rank {
            return Err(self.bad("stored paddings"));
        }
        let axes: Vec<usize> = if rank == 4 { CHANNELS_FIRST.to_vec() } else { (0..rank).collect() };
        let side = |end: usize| axes.iter().map(move |&axis| i64::from(amounts[2 * axis + end]));
        let pads: Vec<i64> = side(0).chain(side(1)).collect();
        let stored = self.local("pads");
        to.graph.ints(&stored, &pads);
        self.emit(to, "Pad", &[&name(self.input(0)?), &stored], &[], Activation::None)
    }

    /// The numbers keep their channels-last order, so pictures are turned before and after.
    fn reshape(&self, to: &mut Translation) -> Result<(), TfliteError> {
        let (input, output) = (self.input(0)?, self.output()?);
        let order = |axes: [usize; 4]| [Attribute::Ints("perm", axes.map(|a| a as i64).to_vec())];
        let mut from = name(input);
        if to.shape(input).len() == 4 {
            let turned = self.local("channels_last");
            to.graph.node("Transpose", &[&from], &turned, &order(CHANNELS_LAST));
            from = turned;
        }
        let shape: Vec<i64> = to.shape(output).iter().map(|&n| n as i64).collect();
        let stored = self.local("shape");
        to.graph.ints(&stored, &shape);
        if shape.len() == 4 {
            let turned = self.local("reshaped");
            to.graph.node("Reshape", &[&from, &stored], &turned, &[]);
            to.graph.node("Transpose", &[&turned], &name(output), &order(CHANNELS_FIRST));
        } else {
            to.graph.node("Reshape", &[&from, &stored], &name(output), &[]);
        }
        Ok(())
    }

    fn resize(&self, to: &mut Translation, align_corners: bool, half_pixel: bool) -> Result<(), TfliteError> {
        let sizes: Vec<i64> = to.onnx_shape(self.output()?).iter().map(|&n| n as i64).collect();
        let coordinates = match (align_corners, half_pixel) {
            (true, _) => "align_corners",
            (false, true) => "half_pixel",
            (false, false) => "asymmetric",
        };
        let attributes =
            [Attribute::Word("mode", "linear"), Attribute::Word("coordinate_transformation_mode", coordinates)];
        let stored = self.local("sizes");
        to.graph.ints(&stored, &sizes);
        self.emit(to, "Resize", &[&name(self.input(0)?), "", "", &stored], &attributes, Activation::None)
    }
}

#[cfg(test)]
mod tests {
    use super::super::schema::Tensor;
    use super::*;
    use rten_tensor::{Tensor as RtenTensor, prelude::*};

    fn variable(shape: &[usize]) -> Tensor {
        Tensor { shape: shape.to_vec(), constant: None }
    }

    /// Numbers without a pattern, between −1 and 1.
    fn numbers(count: usize, seed: u32) -> Vec<f32> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        };
        (0..count).map(|_| next()).collect()
    }

    fn floats(shape: &[usize], seed: u32) -> Tensor {
        let values = numbers(shape.iter().product(), seed);
        Tensor { shape: shape.to_vec(), constant: Some(Constant::Floats(values)) }
    }

    /// A net of one operator: tensor 0 in, constants, the last tensor out.
    fn single(kind: Kind, tensors: Vec<Tensor>) -> Model {
        let last = tensors.len() - 1;
        let operator = Operator { kind, inputs: (0..last).map(Some).collect(), outputs: vec![last] };
        Model { tensors, operators: vec![operator], inputs: vec![0], outputs: vec![last] }
    }

    /// What the translated net makes of a channels-last input, as a flat channels-last list.
    fn run(model: &Model, input: &[f32]) -> Vec<f32> {
        let net = rten::Model::load(to_onnx(model).unwrap()).unwrap();
        let turn = |values: &[f32], shape: &[usize], order: &[usize; 4]| permute(values, shape, order);
        let (shape, values) = turn(input, &model.tensors[0].shape, &CHANNELS_FIRST);
        let result = net.run_one(RtenTensor::from_data(&shape, values).into(), None).unwrap();
        let result: RtenTensor<f32> = result.try_into().unwrap();
        if result.ndim() == 4 { turn(&result.to_vec(), result.shape(), &CHANNELS_LAST).1 } else { result.to_vec() }
    }

    fn assert_close(found: &[f32], expected: &[f32]) {
        assert_eq!(found.len(), expected.len());
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-5, "{a} {b}");
        }
    }

    /// Convolution by its definition, channels last, weights `[out, 3, 3, in]`, stride 2, border filled after.
    fn reference(input: &[f32], [h, w, c]: [usize; 3], weights: &[f32], bias: &[f32]) -> Vec<f32> {
        let mut out = Vec::new();
        for (y, x) in (0..h / 2).flat_map(|y| (0..w / 2).map(move |x| (y, x))) {
            for (o, bias) in bias.iter().enumerate() {
                let mut sum = *bias;
                for (dy, dx) in (0..3).flat_map(|dy| (0..3).map(move |dx| (dy, dx))) {
                    let (row, column) = (2 * y + dy, 2 * x + dx);
                    if row < h && column < w {
                        sum += (0..c)
                            .map(|i| input[(row * w + column) * c + i] * weights[((o * 3 + dy) * 3 + dx) * c + i])
                            .sum::<f32>();
                    }
                }
                out.push(sum.max(0.0));
            }
        }
        out
    }

    const STRIDE_2: Window = Window { padding: Padding::Same, stride: [2, 2], dilation: [1, 1] };

    #[test]
    fn convolution_pads_an_even_picture_at_the_end_as_tensorflow_does() {
        let tensors = vec![variable(&[1, 6, 8, 3]), floats(&[5, 3, 3, 3], 1), floats(&[5], 2), variable(&[1, 3, 4, 5])];
        let input = numbers(6 * 8 * 3, 3);
        let expected = reference(&input, [6, 8, 3], &numbers(135, 1), &numbers(5, 2));
        assert_close(&run(&single(Kind::Conv2d(STRIDE_2, Activation::Relu), tensors), &input), &expected);
    }

    #[test]
    fn depthwise_convolution_is_a_convolution_with_a_diagonal() {
        let tensors = vec![variable(&[1, 4, 4, 2]), floats(&[1, 3, 3, 2], 4), floats(&[2], 5), variable(&[1, 2, 2, 2])];
        let (input, depthwise) = (numbers(32, 6), numbers(18, 4));
        let mut weights = vec![0.0; 36];
        for (tap, channel) in (0..9).flat_map(|tap| [(tap, 0), (tap, 1)]) {
            weights[(channel * 9 + tap) * 2 + channel] = depthwise[tap * 2 + channel];
        }
        let expected = reference(&input, [4, 4, 2], &weights, &numbers(2, 5));
        assert_close(&run(&single(Kind::DepthwiseConv2d(STRIDE_2, Activation::Relu), tensors), &input), &expected);
    }

    #[test]
    fn slopes_belong_to_channels() {
        let tensors = vec![variable(&[1, 2, 3, 4]), floats(&[1, 1, 4], 7), variable(&[1, 2, 3, 4])];
        let (input, slopes) = (numbers(24, 8), numbers(4, 7));
        let expected: Vec<f32> =
            input.iter().enumerate().map(|(k, &x)| if x < 0.0 { x * slopes[k % 4] } else { x }).collect();
        assert_close(&run(&single(Kind::Prelu, tensors), &input), &expected);
    }

    #[test]
    fn reshaping_keeps_the_channels_last_order() {
        let tensors = vec![variable(&[1, 2, 3, 4]), variable(&[1, 6, 4])];
        let input = numbers(24, 9);
        assert_close(&run(&single(Kind::Reshape, tensors), &input), &input);
    }

    #[test]
    fn new_channels_are_padded_with_zeros() {
        let amounts = Tensor { shape: vec![4, 2], constant: Some(Constant::Ints(vec![0, 0, 0, 0, 0, 0, 0, 2])) };
        let tensors = vec![variable(&[1, 2, 2, 1]), amounts, variable(&[1, 2, 2, 3])];
        let expected: Vec<f32> = [1.0, 2.0, 3.0, 4.0].iter().flat_map(|&v| [v, 0.0, 0.0]).collect();
        assert_close(&run(&single(Kind::Pad, tensors), &[1.0, 2.0, 3.0, 4.0]), &expected);
    }

    #[test]
    fn the_largest_of_a_window_is_kept() {
        let tensors = vec![variable(&[1, 2, 4, 1]), variable(&[1, 1, 2, 1])];
        let input = [1.0, -2.0, -5.0, -4.0, 0.0, 3.0, -7.0, -6.0];
        let kind = Kind::MaxPool2d(STRIDE_2, [2, 2], Activation::None);
        assert_close(&run(&single(kind, tensors), &input), &[3.0, -4.0]);
    }

    #[test]
    fn the_mean_of_a_window_leaves_out_what_is_beyond_the_border() {
        let tensors = vec![variable(&[1, 2, 3, 1]), variable(&[1, 1, 2, 1])];
        let kind = Kind::AveragePool2d(STRIDE_2, [2, 2], Activation::None);
        assert_close(&run(&single(kind, tensors), &[1.0, 2.0, 5.0, 3.0, 6.0, 9.0]), &[3.0, 7.0]);
    }

    #[test]
    fn each_function_is_what_its_name_says() {
        type Function = (Kind, fn(f32) -> f32);
        let functions: [Function; 2] = [
            (Kind::HardSwish, |x| x * (x + 3.0).clamp(0.0, 6.0) / 6.0),
            (Kind::Logistic, |x| 1.0 / (1.0 + (-x).exp())),
        ];
        let input = [-4.0, -3.0, -1.5, 0.0, 0.5, 3.5];
        for (kind, function) in functions {
            let tensors = vec![variable(&[1, 1, 6, 1]), variable(&[1, 1, 6, 1])];
            assert_close(&run(&single(kind, tensors), &input), &input.map(function));
        }
    }

    #[test]
    fn channels_are_multiplied_each_with_its_own_number() {
        let tensors = vec![variable(&[1, 2, 2, 3]), floats(&[1, 1, 1, 3], 11), variable(&[1, 2, 2, 3])];
        let (input, factors) = (numbers(12, 10), numbers(3, 11));
        let expected: Vec<f32> = input.iter().enumerate().map(|(k, x)| x * factors[k % 3]).collect();
        assert_close(&run(&single(Kind::Mul(Activation::None), tensors), &input), &expected);
    }

    /// Transposed convolution by its definition, channels last, one channel out, stride 2.
    fn scattered(input: &[f32], [h, w, c]: [usize; 3], weights: &[f32], kernel: usize, bias: f32) -> Vec<f32> {
        // TensorFlow centres a kernel that reaches beyond the result, and cuts the smaller half first.
        let before = (kernel - 2) / 2;
        let mut out = vec![bias; 4 * h * w];
        for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
            for (dy, dx) in (0..kernel).flat_map(|dy| (0..kernel).map(move |dx| (dy, dx))) {
                let (row, column) = ((2 * y + dy).wrapping_sub(before), (2 * x + dx).wrapping_sub(before));
                if row < 2 * h && column < 2 * w {
                    let tap = (dy * kernel + dx) * c;
                    out[row * 2 * w + column] +=
                        (0..c).map(|i| input[(y * w + x) * c + i] * weights[tap + i]).sum::<f32>();
                }
            }
        }
        out
    }

    #[test]
    fn a_transposed_convolution_adds_up_the_windows_of_its_pixels() {
        for kernel in [2, 3, 4] {
            let weights = floats(&[1, kernel, kernel, 4], 12);
            let tensors = vec![variable(&[1, 3, 5, 4]), weights, floats(&[1], 13), variable(&[1, 6, 10, 1])];
            let input = numbers(60, 14);
            let expected = scattered(&input, [3, 5, 4], &numbers(4 * kernel * kernel, 12), kernel, numbers(1, 13)[0]);
            assert_close(&run(&single(Kind::TransposeConv2d(STRIDE_2), tensors), &input), &expected);
        }
    }

    #[test]
    fn a_transposed_convolution_whose_result_has_another_size_is_an_error() {
        let tensors =
            vec![variable(&[1, 3, 5, 4]), floats(&[1, 2, 2, 4], 1), floats(&[1], 2), variable(&[1, 7, 10, 1])];
        let error = to_onnx(&single(Kind::TransposeConv2d(STRIDE_2), tensors)).unwrap_err();
        assert_eq!(error, TfliteError::BadOperator { operator: 0, what: "size of the result" });
    }

    #[test]
    fn a_convolution_without_weights_is_an_error() {
        let tensors = vec![variable(&[1, 6, 8, 3]), variable(&[5, 3, 3, 3]), variable(&[1, 3, 4, 5])];
        let error = to_onnx(&single(Kind::Conv2d(STRIDE_2, Activation::None), tensors)).unwrap_err();
        assert_eq!(error, TfliteError::BadOperator { operator: 0, what: "weights" });
    }
}
