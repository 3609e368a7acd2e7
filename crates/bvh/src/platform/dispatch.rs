//! Instruction sets and the dispatch of kernels.

use std::sync::OnceLock;

/// An instruction set for which kernels are compiled. Hits are bit-identical on all instruction sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// Plain Rust, for any machine.
    Portable,
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// x86-64 with AVX-512 F, VL, DQ and BW.
    Avx512,
    /// aarch64, of which NEON is a part.
    Neon,
    /// wasm32, compiled with SIMD128.
    Simd128,
}

impl InstructionSet {
    /// All instruction sets, the narrowest first.
    pub const ALL: [InstructionSet; 5] = [Self::Portable, Self::Neon, Self::Simd128, Self::Avx2, Self::Avx512];

    /// Name of the instruction set, as in `RAYCAM_ISA`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
            Self::Neon => "neon",
            Self::Simd128 => "simd128",
        }
    }

    /// True if this machine has the instruction set.
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => {
                is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("bmi1")
                    && is_x86_feature_detected!("bmi2")
                    && is_x86_feature_detected!("lzcnt")
                    && is_x86_feature_detected!("popcnt")
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512bw")
            }
            #[cfg(target_arch = "aarch64")]
            Self::Neon => std::arch::is_aarch64_feature_detected!("neon"),
            // A module with unsupported instructions is rejected as a whole, so a running module supports them.
            Self::Simd128 => cfg!(all(target_arch = "wasm32", target_feature = "simd128")),
            #[allow(unreachable_patterns)]
            _ => false,
        }
    }

    /// Widest instruction set of this machine, or the one named by the environment variable `RAYCAM_ISA`. An unknown or
    /// unavailable name is reported on stderr once, and ignored.
    pub fn detect() -> InstructionSet {
        static BEST: OnceLock<InstructionSet> = OnceLock::new();
        *BEST.get_or_init(|| {
            let available = || Self::ALL.into_iter().filter(|isa| isa.is_available());
            let widest = available().next_back().unwrap_or(Self::Portable);
            let Some(asked) = std::env::var_os("RAYCAM_ISA").filter(|name| !name.is_empty()) else {
                return widest;
            };
            available().find(|isa| asked == isa.name()).unwrap_or_else(|| {
                let names: Vec<_> = available().map(Self::name).collect();
                eprintln!(
                    "RAYCAM_ISA={} is not supported by this machine; available: {}",
                    asked.display(),
                    names.join(", ")
                );
                widest
            })
        })
    }
}

/// An instruction set that this machine supports. Kernels require this type as proof of the support.
#[derive(Clone, Copy, Debug)]
pub struct Dispatch(InstructionSet);

impl Dispatch {
    /// Selects the widest available instruction set, or the one named by `RAYCAM_ISA`.
    pub fn detect() -> Dispatch {
        Dispatch(InstructionSet::detect())
    }

    /// Selects the given instruction set; `None` if it is not available.
    pub fn try_new(isa: InstructionSet) -> Option<Dispatch> {
        isa.is_available().then_some(Dispatch(isa))
    }

    /// The selected instruction set.
    pub fn isa(self) -> InstructionSet {
        self.0
    }
}

/// `kernel!(fn name(arguments) = generic)`: a function that runs `generic::<I>(arguments)` compiled for each
/// instruction set, selected by its first argument, a [`Dispatch`]. It may be generic: `fn name[T: Trait](arguments)`.
macro_rules! kernel {
    ($(#[$doc:meta])* fn $name:ident$([$g:ident: $bound:path])?($($arg:ident: $type:ty),* $(,)?) = $generic:ident) => {
        $(#[$doc])*
        pub fn $name$(<$g: $bound>)?(machine: $crate::platform::dispatch::Dispatch, $($arg: $type),*) {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
            fn avx2$(<$g: $bound>)?($($arg: $type),*) {
                $generic::<$crate::simd::Avx2 $(, $g)?>($($arg),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
            fn avx512$(<$g: $bound>)?($($arg: $type),*) {
                $generic::<$crate::simd::Avx512 $(, $g)?>($($arg),*)
            }
            #[cfg(target_arch = "aarch64")]
            #[target_feature(enable = "neon")]
            fn neon$(<$g: $bound>)?($($arg: $type),*) {
                $generic::<$crate::simd::Neon $(, $g)?>($($arg),*)
            }
            match machine.isa() {
                // SAFETY: a `Dispatch` is created only for an instruction set that was found to be available.
                #[cfg(target_arch = "x86_64")]
                $crate::platform::dispatch::InstructionSet::Avx2 => unsafe { avx2($($arg),*) },
                // SAFETY: as above.
                #[cfg(target_arch = "x86_64")]
                $crate::platform::dispatch::InstructionSet::Avx512 => unsafe { avx512($($arg),*) },
                // SAFETY: as above.
                #[cfg(target_arch = "aarch64")]
                $crate::platform::dispatch::InstructionSet::Neon => unsafe { neon($($arg),*) },
                #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
                $crate::platform::dispatch::InstructionSet::Simd128 => {
                    $generic::<$crate::simd::Simd128 $(, $g)?>($($arg),*)
                }
                _ => $generic::<$crate::simd::Portable $(, $g)?>($($arg),*),
            }
        }
    };
}
pub(crate) use kernel;

/// Vectorisable work of other crates. `run` and its callees must be `#[inline(always)]`.
pub trait WithSimd {
    /// Does the work; the code is compiled for the selected instruction set.
    fn run(self);
}

/// Runs work compiled for [`InstructionSet::detect`]. Results are bit-identical on all instruction sets, because the
/// compiler neither reorders nor fuses floating-point operations.
pub fn dispatch_simd<W: WithSimd>(work: W) {
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn avx2<W: WithSimd>(work: W) {
        work.run();
    }
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn avx512<W: WithSimd>(work: W) {
        work.run();
    }
    match InstructionSet::detect() {
        // SAFETY: [`InstructionSet::detect`] returns only instruction sets that this machine supports.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => unsafe { avx2(work) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => unsafe { avx512(work) },
        // NEON is part of every aarch64.
        _ => work.run(),
    }
}
