"""Read and write the formats of strong-motion records."""
