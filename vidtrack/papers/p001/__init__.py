"""Paper 001: a survey of multiple-target tracking (Lim). Its figures are sketches without numbers."""
