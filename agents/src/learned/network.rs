//! The network, without the library that trained it.

use std::sync::LazyLock;

/// What `python -m benchmarks.learned --export` has written.
const WEIGHTS: &[u8] = include_bytes!("../../learned/maskable-routing/policy.bin");
/// How such a file begins.
const MAGIC: &[u8; 8] = b"swathcp1";

static SHIPPED: LazyLock<Network> =
    LazyLock::new(|| Network::read(WEIGHTS).expect("the shipped weights are whole"));

/// Scores the rows of a table of candidates, each by itself and in the company of the others; the actor of
/// `CandidateNetwork` in `swath.training.networks`.
///
/// Single precision, summed in the order of the inputs and never fused, so it scores the same on every machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    columns: usize,
    width: usize,
    encode: [Dense; 2],
    score: [Dense; 3],
}

/// A layer: for each input a row of weights, one for each output.
#[derive(Debug, Clone, PartialEq)]
struct Dense {
    weights: Vec<f32>,
    bias: Vec<f32>,
}

impl Dense {
    fn read(
        numbers: &mut impl Iterator<Item = f32>,
        inputs: usize,
        outputs: usize,
    ) -> Option<Self> {
        let mut take = |count: usize| {
            let taken: Vec<f32> = numbers.by_ref().take(count).collect();
            (taken.len() == count && taken.iter().all(|number| number.is_finite())).then_some(taken)
        };
        Some(Self { weights: take(inputs * outputs)?, bias: take(outputs)? })
    }

    /// Adds what the inputs from number `first` on contribute.
    fn add(&self, first: usize, inputs: &[f32], sums: &mut [f32]) {
        let rows = self.weights.chunks_exact(sums.len()).skip(first);
        for (&input, weights) in inputs.iter().zip(rows) {
            // After a rectifier many inputs are nothing.
            if input != 0.0 {
                for (sum, &weight) in sums.iter_mut().zip(weights) {
                    *sum += input * weight;
                }
            }
        }
    }

    fn apply(&self, inputs: &[f32]) -> Vec<f32> {
        let mut sums = self.bias.clone();
        self.add(0, inputs, &mut sums);
        sums
    }
}

fn rectified(mut numbers: Vec<f32>) -> Vec<f32> {
    for number in &mut numbers {
        *number = number.max(0.0);
    }
    numbers
}

impl Network {
    /// The network that is shipped.
    #[must_use]
    pub fn shipped() -> &'static Self {
        &SHIPPED
    }

    /// Reads weights: `swathcp1`, the number of columns and the width as 32-bit numbers, then layer by layer weights and
    /// biases as 32-bit floats, all of them little-endian. `None` if it is anything else.
    #[must_use]
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let (words, []) = bytes.strip_prefix(MAGIC)?.as_chunks::<4>() else { return None };
        let ([columns, width], numbers) = words.split_first_chunk::<2>()?;
        let size = |word: &[u8; 4]| u16::try_from(u32::from_le_bytes(*word)).ok().map(usize::from);
        let (columns, width) = (size(columns)?, size(width)?);
        let mut numbers = numbers.iter().map(|word| f32::from_le_bytes(*word));
        let mut layer = |inputs, outputs| Dense::read(&mut numbers, inputs, outputs);
        let encode = [layer(columns, width)?, layer(width, width)?];
        let score = [layer(3 * width, width)?, layer(width, width)?, layer(width, 1)?];
        (columns > 0 && width > 0 && numbers.next().is_none()).then_some(Self {
            columns,
            width,
            encode,
            score,
        })
    }

    /// Number of columns of a table.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The scores of the rows of a flat table; negative infinity for those that are empty.
    #[must_use]
    pub fn scores(&self, table: &[f32]) -> Vec<f32> {
        let encoded: Vec<Option<Vec<f32>>> = table
            .chunks_exact(self.columns)
            .map(|row| {
                let is_row = row.iter().any(|&number| number != 0.0);
                is_row
                    .then(|| rectified(self.encode[1].apply(&rectified(self.encode[0].apply(row)))))
            })
            .collect();
        // The company: mean and maximum of the rows.
        let (mut mean, mut most) = (vec![0.0_f32; self.width], vec![0.0_f32; self.width]);
        let rows = encoded.iter().flatten().count().max(1) as f32;
        for row in encoded.iter().flatten() {
            for ((sum, most), &number) in mean.iter_mut().zip(&mut most).zip(row) {
                *sum += number;
                *most = most.max(number);
            }
        }
        for sum in &mut mean {
            *sum /= rows;
        }
        let [first, second, last] = &self.score;
        let mut company = first.bias.clone();
        first.add(self.width, &mean, &mut company);
        first.add(2 * self.width, &most, &mut company);
        let score = |row: &Vec<f32>| {
            let mut sums = company.clone();
            first.add(0, row, &mut sums);
            last.apply(&rectified(second.apply(&rectified(sums))))[0]
        };
        encoded.iter().map(|row| row.as_ref().map_or(f32::NEG_INFINITY, score)).collect()
    }

    /// The place with the highest score, the first of several.
    #[must_use]
    pub fn best(&self, table: &[f32]) -> usize {
        let mut best = (f32::NEG_INFINITY, 0);
        for (place, score) in self.scores(table).into_iter().enumerate() {
            if score > best.0 {
                best = (score, place);
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_that_are_not_whole_are_refused() {
        assert!(Network::read(WEIGHTS).is_some());
        assert!(Network::read(&WEIGHTS[..WEIGHTS.len() - 4]).is_none());
        assert!(Network::read(&WEIGHTS[..WEIGHTS.len() - 1]).is_none());
        assert!(Network::read(&WEIGHTS[4..]).is_none());
        let mut weights = WEIGHTS.to_vec();
        weights[16..20].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(Network::read(&weights).is_none());
        assert!(Network::read(&[WEIGHTS, &[0; 4]].concat()).is_none());
    }

    /// Two columns and one unit a layer, worked out by hand.
    #[test]
    fn a_row_is_scored_by_itself_and_by_mean_and_maximum_of_all() {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([2_u32, 1].iter().flat_map(|number| number.to_le_bytes()));
        // Encoded: the sum of the columns, twice. Scored: 1 x the row + 10 x the mean + 100 x the maximum + 1, then unchanged.
        let layers = [1.0, 1.0, 0.0, 2.0, 0.0, 1.0, 10.0, 100.0, 1.0, 1.0, 0.0, 1.0, 0.0_f32];
        bytes.extend(layers.iter().flat_map(|number| number.to_le_bytes()));
        let network = Network::read(&bytes).unwrap();
        let scores = network.scores(&[1.0, 0.0, 0.0, 0.0, 1.0, 2.0]);
        // Rows 2 and 6, mean 4, maximum 6; the empty one takes no part.
        assert_eq!(scores, [643.0, f32::NEG_INFINITY, 647.0]);
        assert_eq!(network.best(&[1.0, 0.0, 0.0, 0.0, 1.0, 2.0]), 2);
        assert_eq!(network.best(&[1.0, 2.0, 0.0, 0.0, 2.0, 1.0]), 0);
    }
}
