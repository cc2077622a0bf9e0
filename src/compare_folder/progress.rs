//! What a comparison of folders says while it works.

/// The receiver of the progress.
pub(crate) trait ReportProgress {
    /// Begins a part of the work over so many items.
    fn begin(&mut self, items: usize);
    /// Counts an item that is done.
    fn done(&mut self, name: &str);
}
