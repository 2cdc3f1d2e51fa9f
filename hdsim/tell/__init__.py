"""What a fit or a diagnosis found, told: report, figures, words, terminal."""
