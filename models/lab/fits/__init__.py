"""Constants that are fitted on data: each module writes a file or prints figures that the models hold."""
