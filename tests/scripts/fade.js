// The program of external-file.wrl.
function initialize() { out = 0.375; }
