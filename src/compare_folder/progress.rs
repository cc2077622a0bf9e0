//! What a comparison of folders says while it works.

/// The receiver of the progress.
pub(crate) trait ReportProgress {
    /// Begins a part of the work over so many items. `what` names one of them.
    fn begin(&mut self, what: &str, items: usize);
    /// Counts an item that is done.
    fn done(&mut self, name: &str);
}
