//! Memory that is wanted soon.

/// What a processor fetches at a time.
#[cfg(target_arch = "x86_64")]
const LINE_BYTES: usize = 64;

/// Asks the processor to fetch values before they are wanted. Nothing but the time of what comes depends on it, and
/// processors of another kind than `x86_64` are not asked.
#[inline]
#[cfg_attr(not(target_arch = "x86_64"), expect(unused_variables, reason = "nobody is asked"))]
pub(crate) fn fetch<T>(values: &[T]) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let first = values.as_ptr().cast::<i8>();
        // They may begin in the middle of a line, and so end in one more.
        for offset in (0..size_of_val(values) + LINE_BYTES - 1).step_by(LINE_BYTES) {
            let line = first.wrapping_add(offset);
            #[expect(unsafe_code, reason = "the only way to ask")]
            // SAFETY: a prefetch reads nothing that the program could see and never faults, whatever the address.
            unsafe {
                _mm_prefetch::<_MM_HINT_T0>(line);
            }
        }
    }
}
