//! Named expressions as sums of the 52 keys.
//!
//! # Entry points
//! [`expressions`], [`expression`]; [`crate::visemes::compose`] makes a key of one.
//!
//! Chosen by the action units of facial action coding (Ekman, Friesen, Hager 2002; prototypes in table 10-1 of its
//! investigator's guide), each unit by its ARKit key: 1 `browInnerUp`, 2 `browOuterUp`, 4 `browDown`, 5 `eyeWide`,
//! 6 `cheekSquint`, 7 `eyeSquint`, 9 `noseSneer`, 10 `mouthUpperUp`, 12 `mouthSmile`, 15 `mouthFrown`, 16 `mouthLowerDown`,
//! 17 `mouthShrugLower`, 20 `mouthStretch`, 23 `mouthPress` and `mouthRoll`, 26 `jawOpen`. Weights above 1 make up for keys that are weak.

/// An expression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expression {
    /// Its name, lower case.
    pub name: &'static str,
    /// Key names and their weights; 1 is the whole key.
    pub weights: &'static [(&'static str, f64)],
}

const EXPRESSIONS: [Expression; 7] = [
    // 6 + 12 (+ 25: the lips part)
    Expression {
        name: "happiness",
        weights: &[
            ("cheekSquintLeft", 1.0),
            ("cheekSquintRight", 1.0),
            ("mouthSmileLeft", 0.9),
            ("mouthSmileRight", 0.9),
            ("eyeSquintLeft", 0.5),
            ("eyeSquintRight", 0.5),
            ("jawOpen", 0.12),
            ("mouthUpperUpLeft", 0.3),
            ("mouthUpperUpRight", 0.3),
        ],
    },
    // 1 + 2 + 5 + 26
    Expression {
        name: "surprise",
        weights: &[
            ("browInnerUp", 1.3),
            ("browOuterUpLeft", 1.1),
            ("browOuterUpRight", 1.1),
            ("eyeWideLeft", 1.0),
            ("eyeWideRight", 1.0),
            ("jawOpen", 0.55),
            ("mouthFunnel", 0.2),
        ],
    },
    // 12, lips closed
    Expression {
        name: "smile",
        weights: &[
            ("mouthSmileLeft", 0.65),
            ("mouthSmileRight", 0.65),
            ("cheekSquintLeft", 0.4),
            ("cheekSquintRight", 0.4),
            ("mouthDimpleLeft", 0.2),
            ("mouthDimpleRight", 0.2),
        ],
    },
    // 1 + 2 + 4 + 5 + 7 + 20 + 26
    Expression {
        name: "fear",
        weights: &[
            ("browInnerUp", 1.4),
            ("browOuterUpLeft", 0.6),
            ("browOuterUpRight", 0.6),
            ("browDownLeft", 0.5),
            ("browDownRight", 0.5),
            ("eyeWideLeft", 1.1),
            ("eyeWideRight", 1.1),
            ("eyeSquintLeft", 0.2),
            ("eyeSquintRight", 0.2),
            ("mouthStretchLeft", 1.0),
            ("mouthStretchRight", 1.0),
            ("jawOpen", 0.25),
        ],
    },
    // 4 + 5 + 7 + 23
    Expression {
        name: "anger",
        weights: &[
            ("browDownLeft", 1.0),
            ("browDownRight", 1.0),
            ("eyeWideLeft", 0.4),
            ("eyeWideRight", 0.4),
            ("eyeSquintLeft", 0.6),
            ("eyeSquintRight", 0.6),
            ("mouthPressLeft", 0.8),
            ("mouthPressRight", 0.8),
            ("mouthRollLower", 0.3),
            ("mouthRollUpper", 0.2),
            ("noseSneerLeft", 0.25),
            ("noseSneerRight", 0.25),
        ],
    },
    // 1 + 4 + 15
    Expression {
        name: "sadness",
        weights: &[
            ("browInnerUp", 1.5),
            ("browDownLeft", 0.5),
            ("browDownRight", 0.5),
            ("mouthFrownLeft", 1.1),
            ("mouthFrownRight", 1.1),
            ("mouthShrugLower", 0.4),
        ],
    },
    // 9 + 15 + 16
    Expression {
        name: "disgust",
        weights: &[
            ("noseSneerLeft", 1.3),
            ("noseSneerRight", 1.3),
            ("browDownLeft", 0.4),
            ("browDownRight", 0.4),
            ("mouthUpperUpLeft", 0.6),
            ("mouthUpperUpRight", 0.6),
            ("mouthFrownLeft", 0.8),
            ("mouthFrownRight", 0.8),
            ("mouthLowerDownLeft", 0.4),
            ("mouthLowerDownRight", 0.4),
            ("eyeSquintLeft", 0.5),
            ("eyeSquintRight", 0.5),
        ],
    },
];

/// All expressions: happiness, surprise, smile, fear (the paper's, its figure 7), anger, sadness, disgust.
pub fn expressions() -> &'static [Expression] {
    &EXPRESSIONS
}

/// The expression of a name.
pub fn expression(name: &str) -> Option<&'static Expression> {
    EXPRESSIONS.iter().find(|e| e.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_expressions_are_there_and_left_equals_right() {
        assert!(["happiness", "surprise", "smile", "fear"].iter().all(|n| expression(n).is_some()));
        for e in expressions() {
            for (name, weight) in e.weights {
                let Some(stem) = name.strip_suffix("Left") else { continue };
                let other = e.weights.iter().find(|(n, _)| n.strip_suffix("Right") == Some(stem));
                assert_eq!(other.map(|o| o.1), Some(*weight), "{}: {name}", e.name);
            }
        }
    }
}
