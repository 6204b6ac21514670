"""Other programs on the problems of this project, each driven as its own users would: nothing here is used by the packages."""
