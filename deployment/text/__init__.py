"""From the text of a deployment file to a tree with places, in which nothing is abbreviated any more."""
