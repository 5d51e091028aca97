//! Who follows a load while it is solved.

/// Is told once an iteration how far a load has come, and says whether it is to go on. A function
/// without arguments is one that hears nothing: whether it has been interrupted.
pub trait Watch {
    /// Whether to stop here: the best pressure so far is the outcome.
    fn is_interrupted(&self) -> bool;

    /// So many transform pairs have been spent on the load.
    fn spent(&self, _pairs: u32) {}
}

impl<F: Fn() -> bool> Watch for F {
    fn is_interrupted(&self) -> bool {
        self()
    }
}
