//! The functions that take the place of the driver's: one generic function for each number of arguments, instantiated for
//! each command.

use ash::vk;

use super::dispatch::next;
use super::injector::injector;

/// Returns an argument as a number: a handle, a pointer, a count. Arguments of other sizes give 0.
fn word<T: Copy>(value: T) -> u64 {
    match size_of::<T>() {
        // SAFETY: the value has 8 bytes.
        8 => unsafe { std::mem::transmute_copy::<T, u64>(&value) },
        // SAFETY: the value has 4 bytes.
        4 => u64::from(unsafe { std::mem::transmute_copy::<T, u32>(&value) }),
        _ => 0,
    }
}

/// Declares the wrapper of commands with this many arguments: counts the call, answers the fault or calls the next
/// layer, and counts the objects that were made.
macro_rules! wrapper {
    ($name:ident $($argument:ident: $type:ident),+) => {
        /// Returns the address of the wrapper of command `N`.
        pub(super) fn $name<const N: usize, $($type: Copy),+>(
            _: Option<unsafe extern "system" fn($($type),+) -> vk::Result>,
        ) -> usize {
            unsafe extern "system" fn wrapped<const N: usize, $($type: Copy),+>(
                $($argument: $type),+
            ) -> vk::Result {
                let words = [$(word($argument)),+];
                // SAFETY: these are the arguments of the call.
                unsafe { injector().names(N, &words) };
                let fault = injector().called(N, words[0]);
                injector().uses(N, &words, fault.is_some());
                if let Some(fault) = fault.filter(|fault| !injector().still_executes(N, *fault)) {
                    return fault.result();
                }
                let Some(next) = next(N, words[0]) else {
                    return vk::Result::ERROR_EXTENSION_NOT_PRESENT;
                };
                // SAFETY: the address is that of the command in the next layer, which has this type.
                let next = unsafe {
                    std::mem::transmute::<usize, unsafe extern "system" fn($($type),+) -> vk::Result>(next)
                };
                // SAFETY: the arguments are those of the caller.
                let result = unsafe { next($($argument),+) };
                if let Some(fault) = fault {
                    // SAFETY: these are the arguments of the call; only one that maps memory may have no address.
                    unsafe { injector().maps(&words, fault) };
                    return fault.result();
                }
                injector().returned(N, words[0]);
                if result.as_raw() >= 0 {
                    // SAFETY: a command that creates objects has written their handles to its last argument.
                    unsafe { injector().created(N, &words) };
                    // SAFETY: these are the arguments of the call, which has succeeded.
                    unsafe {
                        injector().allocated(N, &words);
                        injector().listed(N, &words);
                    }
                }
                result
            }
            wrapped::<N, $($type),+> as *const () as usize
        }
    };
}

wrapper!(one a: A);
wrapper!(two a: A, b: B);
wrapper!(three a: A, b: B, c: C);
wrapper!(four a: A, b: B, c: C, d: D);
wrapper!(five a: A, b: B, c: C, d: D, e: E);
wrapper!(six a: A, b: B, c: C, d: D, e: E, f: F);
wrapper!(seven a: A, b: B, c: C, d: D, e: E, f: F, g: G);
wrapper!(eight a: A, b: B, c: C, d: D, e: E, f: F, g: G, h: H);

/// Returns the address of the wrapper of command `N`, which destroys its second argument.
pub(super) fn end<const N: usize, A: Copy, B: Copy, C: Copy>(
    _: Option<unsafe extern "system" fn(A, B, C)>,
) -> usize {
    unsafe extern "system" fn wrapped<const N: usize, A: Copy, B: Copy, C: Copy>(
        owner: A,
        object: B,
        allocator: C,
    ) {
        injector().destroys(N, word(owner), word(object));
        injector().uses(N, &[word(owner), word(object)], false);
        if let Some(next) = next(N, word(owner)) {
            // SAFETY: the address is that of the command in the next layer, which has this type.
            let next = unsafe { std::mem::transmute::<usize, unsafe extern "system" fn(A, B, C)>(next) };
            // SAFETY: the arguments are those of the caller.
            unsafe { next(owner, object, allocator) };
        }
    }
    wrapped::<N, A, B, C> as *const () as usize
}
