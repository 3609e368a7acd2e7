"""Options of rigs, looks and framing, which several commands share."""
