//! Signals that ask a run to end: an interrupt from the keyboard, and the termination that batch systems send.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// The signals of the process from now on: the first one is kept for the run to see, the second one ends the process.
pub(super) struct Interrupts {
    /// Number of the signal; zero as long as there was none.
    signal: Arc<AtomicUsize>,
}

/// Exit status of a process that a signal ended, less the number of the signal, as shells count.
const STATUS: u8 = 128;

impl Interrupts {
    /// Takes the signals over from the operating system, which would end the process.
    ///
    /// # Errors
    /// A system that hands out no signals.
    pub fn watch() -> io::Result<Self> {
        let signal = Arc::new(AtomicUsize::new(0));
        let again = Arc::new(AtomicBool::new(false));
        for number in [SIGINT, SIGTERM] {
            // in this order: the flag that ends the process is not up yet at the first signal
            flag::register_conditional_shutdown(number, i32::from(STATUS) + number, Arc::clone(&again))?;
            flag::register(number, Arc::clone(&again))?;
            flag::register_usize(number, Arc::clone(&signal), usize::try_from(number).unwrap_or(usize::MAX))?;
        }
        Ok(Self { signal })
    }

    /// The exit status that the signal calls for, once there has been one: 130 after an interrupt, 143 after a
    /// termination.
    pub fn exit_status(&self) -> Option<u8> {
        let signal = u8::try_from(self.signal.load(Ordering::Relaxed)).unwrap_or(u8::MAX);
        (signal != 0).then(|| STATUS.saturating_add(signal))
    }
}
