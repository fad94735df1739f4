//! Numbers as little-endian bytes, and back.

use std::borrow::Cow;

use bytemuck::NoUninit;

use crate::fault::Fault;

/// A number with a fixed width on the wire.
pub trait Number: NoUninit + Default {
    /// Bytes of one.
    const BYTES: usize;
    /// Adds its bytes.
    fn put(self, bytes: &mut Vec<u8>);
    /// Reads as many numbers as there are places in the table from as many bytes; whether all of them stand for numbers.
    fn get_all(bytes: &[u8], table: &mut [Self]) -> bool;
}

macro_rules! numbers {
    ($($number:ty),*) => { $(
        impl Number for $number {
            const BYTES: usize = size_of::<$number>();
            fn put(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
            fn get_all(bytes: &[u8], table: &mut [Self]) -> bool {
                bytemuck::cast_slice_mut(table).copy_from_slice(bytes);
                if cfg!(target_endian = "big") {
                    for number in table {
                        *number = Self::from_le_bytes(number.to_ne_bytes());
                    }
                }
                true
            }
        }
    )* };
}

numbers!(u8, i8, u32, i64, u64, f32, f64);

impl Number for bool {
    const BYTES: usize = 1;
    fn put(self, bytes: &mut Vec<u8>) {
        bytes.push(u8::from(self));
    }
    fn get_all(bytes: &[u8], table: &mut [Self]) -> bool {
        for (flag, &byte) in table.iter_mut().zip(bytes) {
            *flag = byte == 1;
        }
        // All of them together, not one after the other: many are looked at at once then.
        bytes.iter().fold(0, |all, byte| all | byte) <= 1
    }
}

/// The bytes of numbers.
pub fn bytes_of<T: Number>(numbers: impl IntoIterator<Item = T>) -> Vec<u8> {
    let numbers = numbers.into_iter();
    let mut bytes = Vec::with_capacity(numbers.size_hint().0 * T::BYTES);
    numbers.for_each(|number| number.put(&mut bytes));
    bytes
}

/// The bytes of a table of numbers, where they are if its memory holds them as they are sent.
pub fn bytes_in<T: Number>(table: &[T]) -> Cow<'_, [u8]> {
    if cfg!(target_endian = "little") {
        Cow::Borrowed(bytemuck::cast_slice(table))
    } else {
        Cow::Owned(bytes_of(table.iter().copied()))
    }
}

/// Reads numbers into a table that they have to fill.
///
/// # Errors
///
/// [`Fault::Malformed`] if there are more or fewer, or a bool is neither 0 nor 1.
pub fn read_into<T: Number>(bytes: &[u8], table: &mut [T]) -> Result<(), Fault> {
    let is_full = bytes.len() == table.len() * T::BYTES;
    if is_full && T::get_all(bytes, table) { Ok(()) } else { Err(Fault::Malformed { offset: 0 }) }
}

/// Reads as many numbers as there are.
///
/// # Errors
///
/// [`Fault::Malformed`] if bytes are left over, or a bool is neither 0 nor 1.
pub fn read<T: Number>(bytes: &[u8]) -> Result<Vec<T>, Fault> {
    let mut table = vec![T::default(); bytes.len() / T::BYTES];
    read_into(bytes, &mut table)?;
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_to_the_bit() {
        let numbers = [f64::NAN, -0.0, 1e-320, f64::INFINITY];
        let back: Vec<f64> = read(&bytes_of(numbers)).unwrap();
        assert_eq!(back.map_bits(), numbers.to_vec().map_bits());
        assert_eq!(read::<bool>(&bytes_of([true, false])), Ok(vec![true, false]));
        let mut table = [0.0; 4];
        read_into(&bytes_in(&numbers), &mut table).unwrap();
        assert_eq!(table.to_vec().map_bits(), numbers.to_vec().map_bits());
        assert_eq!(*bytes_in(&[true, false]), [1, 0]);
    }

    trait MapBits {
        fn map_bits(&self) -> Vec<u64>;
    }

    impl MapBits for Vec<f64> {
        fn map_bits(&self) -> Vec<u64> {
            self.iter().map(|number| number.to_bits()).collect()
        }
    }

    #[test]
    fn tables_that_do_not_fit_are_refused() {
        let fault = Err(Fault::Malformed { offset: 0 });
        assert_eq!(read_into(&[0; 7], &mut [0_u32; 2]), fault);
        assert_eq!(read_into(&[0; 12], &mut [0_u32; 2]), fault);
        assert_eq!(read_into(&[2], &mut [false]), fault);
        assert_eq!(read::<u64>(&[0; 9]).map(|_| ()), fault);
    }
}
